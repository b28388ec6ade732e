# SPDX-License-Identifier: Apache-2.0
"""The node of the motor board: `ros2 run fivebar_control motkin_bridge`."""
