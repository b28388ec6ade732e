# SPDX-License-Identifier: Apache-2.0
"""Configuration of the emulated drives, in a file of its own so that it checks the bridge's."""

from __future__ import annotations

from fivebar_description.drive_file import SYNC_PERIOD_US, CanChannel, DriveMotor, SyncPeriod, Unsigned32
from fivebar_description.strict_yaml import StrictModel
from fivebar_sim.emulation_file import EmulatedRobotFile


class DriveFacts(DriveMotor):
    """One emulated drive; see `DriveMotor` for the other keys.

    Attributes:
        vendor, product: content of object 0x1018.
    """

    vendor: Unsigned32
    product: Unsigned32


class DriveFactsPair(StrictModel):
    """Section `drives`: the drive of each motor joint."""

    q11: DriveFacts
    q21: DriveFacts


class EmulationFile(EmulatedRobotFile):
    """One file; see `EmulatedRobotFile` for the other keys. The times of its effects count from the first SYNC.

    Attributes:
        sync_period_us: time by which the robot moves on with every SYNC.
    """

    bus: CanChannel
    robot: str = "dextar"
    sync_period_us: SyncPeriod = SYNC_PERIOD_US
    drives: DriveFactsPair

    @property
    def pair(self) -> tuple[DriveFacts, DriveFacts]:
        """The drives in the order of the motor joints."""
        return self.drives.q11, self.drives.q21
