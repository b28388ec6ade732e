# SPDX-License-Identifier: Apache-2.0
"""The interfaces of vendors' drives, as their entry points name them."""

from __future__ import annotations

from fivebar_description.drive_kinds import DriveKind

MOTKIN_BOARD = DriveKind(
    "motkin",
    connection="fivebar_motkin.motor_board:connect",
    emulation="fivebar_motkin_emulation.emulation:EMULATOR",
    run_files="fivebar_vendor_drives.board_files:RUN_FILES",
    faults="fivebar_motkin.board_faults:FAULTS",
    bridge="motkin_bridge",
    hardware="usb",
)
"""The motor board of the MOTKIN bench on USB."""

ODRIVES = DriveKind(
    "odrive",
    connection="fivebar_odrive.odrive:CONNECTION",
    emulation="fivebar_odrive_emulation.odrive_bus:EMULATOR",
    run_files="fivebar_vendor_drives.pair_files:ODRIVE_FILES",
    faults="fivebar_odrive.odrive:FAULTS",
)
"""Two ODrives on a CAN bus."""

MOTEUS_DRIVES = DriveKind(
    "moteus",
    connection="fivebar_moteus.moteus:CONNECTION",
    emulation="fivebar_moteus_emulation.moteus_bus:EMULATOR",
    run_files="fivebar_vendor_drives.pair_files:MOTEUS_FILES",
    faults="fivebar_moteus.moteus_faults:FAULTS",
    library="moteus",
    installed_by="fivebar[moteus]",
)
"""Two moteus drives on a CAN FD bus."""
