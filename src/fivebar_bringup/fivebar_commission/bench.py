# SPDX-License-Identifier: Apache-2.0
"""The robot as a commissioning needs it, real or simulated: drives, a hand that leads it, and runs under control."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from pathlib import Path
from typing import Protocol

from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.scenario import Scenario
from fivebar_commission.limits import Allowed, AllowedDrives, without_torque_afterwards
from fivebar_commission.person import Person
from fivebar_commission.step import GateClosed
from fivebar_control.hardware.drive_interface import DriveInterface
from fivebar_control.hardware.fault import DriveError
from fivebar_description.imu import ImuSettings


class RobotBench(Protocol):
    """The robot to be commissioned."""

    @property
    def imu(self) -> ImuSettings | None:
        """Prior knowledge of the gyroscope on the distal link of leg 2; None without one."""
        ...

    @property
    def time(self) -> float:
        """Time on the robot so far (s)."""
        ...

    def opened(self, drives: Path, allowed: Allowed) -> AbstractContextManager[AllowedDrives]:
        """Open the drives of a configuration for a block, without torque.

        Raises:
            GateClosed: a drive is missing or cannot be set up.
        """
        ...

    def wait(self) -> None:
        """Wait for the next cycle of the drives."""
        ...

    def record_by_hand(
        self, person: Person, key: str, request: str, scenario: Scenario, drives: Path, out: Path
    ) -> RunDirectory:
        """Record a motion by hand, without power, along a scenario's waypoints.

        Raises:
            GateClosed: a drive has a fault.
        """
        ...

    def run(self, scenario: Scenario, drives: Path, out: Path, page: bool) -> tuple[RunDirectory, Summary]:
        """Run a scenario on the robot, which stands where it begins.

        Raises:
            GateClosed: a drive has a fault.
        """
        ...

    def close(self) -> None:
        """Leave the robot."""
        ...


@contextmanager
def opened_drives(open_drives: Callable[[], DriveInterface], allowed: Allowed) -> Iterator[AllowedDrives]:
    """Open drives for a block, with the functions that open them and set them up.

    Raises:
        GateClosed: a drive is missing, cannot be set up, or has had a fault within the block.
    """
    try:
        with without_torque_afterwards(open_drives(), allowed) as drives:
            yield drives
    except DriveError as error:
        raise GateClosed(error.fault.name, error.fault.detail) from error
