# SPDX-License-Identifier: Apache-2.0
"""Files of a run on two ODrives or two moteus drives, each pair on a CAN bus."""

from __future__ import annotations

from fivebar_bringup.drives.motor_files import MotorRunFiles
from fivebar_bringup.drives.run_files import private_bus_link

ODRIVE_FILES = MotorRunFiles(private_bus_link, shipped="odrive")
MOTEUS_FILES = MotorRunFiles(private_bus_link, shipped="moteus")
