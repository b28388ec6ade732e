"""The interfaces of drives that are shipped, as their entry points name them."""

from __future__ import annotations

from fivebar_description.drive_kinds import DriveKind
from fivebar_description.known_drives import CANOPEN, MOTKIN, ROS2_CONTROL

CANOPEN_DRIVES = DriveKind(
    CANOPEN,
    connection="fivebar_control.hardware.drive_bus:connect",
    emulation="fivebar_sim.drives.hardware:EMULATOR",
    run_files="fivebar_bringup.drives.can_files:RUN_FILES",
    bridge="dextar_bridge",
)
"""Two CiA 402 drives on a CAN bus."""

MOTKIN_BOARD = DriveKind(
    MOTKIN,
    connection="fivebar_control.hardware.motor_board:connect",
    emulation="fivebar_sim.boards.emulation:EMULATOR",
    run_files="fivebar_bringup.drives.board_files:RUN_FILES",
    bridge="motkin_bridge",
)
"""The motor board of the MOTKIN bench on USB."""

ODRIVES = DriveKind(
    "odrive",
    connection="fivebar_control.hardware.odrive:CONNECTION",
    emulation="fivebar_sim.motors.odrive:EMULATOR",
    run_files="fivebar_bringup.drives.odrive_files:RUN_FILES",
    faults="fivebar_control.hardware.odrive:FAULTS",
)
"""Two ODrives on a CAN bus."""

CONTROLLED_JOINTS = DriveKind(
    ROS2_CONTROL,
    connection="fivebar_control.ros.ros2_control:connect",
    emulation="fivebar_sim.ros.ros2_control:EMULATOR",
    run_files="fivebar_bringup.drives.ros2_control_files:RUN_FILES",
    faults="fivebar_control.hardware.controlled_joints:FAULTS",
    beside="command_watchdog",
    on_topics=True,
)
"""Two joints under a controller manager of ros2_control."""

MOTEUS_DRIVES = DriveKind(
    "moteus",
    connection="fivebar_control.hardware.moteus:CONNECTION",
    emulation="fivebar_sim.motors.moteus:EMULATOR",
    run_files="fivebar_bringup.drives.moteus_files:RUN_FILES",
    faults="fivebar_control.hardware.moteus_faults:FAULTS",
    library="moteus",
    installed_by="fivebar[moteus]",
)
"""Two moteus drives on a CAN FD bus."""
