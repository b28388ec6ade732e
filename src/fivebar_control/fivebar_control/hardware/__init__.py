# SPDX-License-Identifier: Apache-2.0
"""The motor drives: configuration, units, the CiA 402 state machine and the CAN bus. No ROS in here."""
