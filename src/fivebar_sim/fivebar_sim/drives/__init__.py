# SPDX-License-Identifier: Apache-2.0
"""Two emulated CiA 402 drives on a CAN bus, which move the simulated robot. No ROS in here."""
