# SPDX-License-Identifier: Apache-2.0
"""The interfaces of drives that every installation has, as their entry points name them."""

from __future__ import annotations

from fivebar_description.drive_kinds import DriveKind
from fivebar_description.known_drives import CANOPEN, ROS2_CONTROL

CANOPEN_DRIVES = DriveKind(
    CANOPEN,
    connection="fivebar_control.hardware.drive_bus:connect",
    emulation="fivebar_sim.drives.hardware:EMULATOR",
    run_files="fivebar_bringup.drives.can_files:RUN_FILES",
    faults="fivebar_control.hardware.drive_faults:FAULTS",
    bridge="dextar_bridge",
    hardware="socketcan",
)
"""Two CiA 402 drives on a CAN bus."""

CONTROLLED_JOINTS = DriveKind(
    ROS2_CONTROL,
    connection="fivebar_control.ros.ros2_control:connect",
    emulation="fivebar_sim.ros.ros2_control:EMULATOR",
    run_files="fivebar_bringup.drives.ros2_control_files:RUN_FILES",
    faults="fivebar_control.hardware.controlled_joints:FAULTS",
    beside="command_watchdog",
    on_topics=True,
    awaited="fivebar_bringup.ros.described_robot:await_robot",
    hardware="external",
)
"""Two joints under a controller manager of ros2_control."""
