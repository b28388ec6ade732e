# SPDX-License-Identifier: Apache-2.0
"""The protocol of two drives, whatever they are: configure, enable, exchange once per cycle, stop, release.

`DriveBus` talks to two CiA 402 drives on a CAN bus, `TwoMotors` to motors that a driver reaches one by one; a board
that is set up as a whole has a class of its own.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol, TypeVar

from fivebar_control.fault import Fault
from fivebar_control.hardware.fault import DriveError

Torques = tuple[float, float]
ZERO: Torques = (0.0, 0.0)


class JointTarget(NamedTuple):
    """Where the motors should be, for drives with an inner loop of their own.

    Attributes:
        weight: how much of the inner loop's gains acts, from 0 to 1.
        positions, velocities: of both motors (rad, rad/s).
    """

    weight: float
    positions: tuple[float, float]
    velocities: tuple[float, float]


class DriveReading(NamedTuple):
    """One drive at one measurement: joint angle (rad), velocity (rad/s) and torque (Nm)."""

    position: float
    velocity: float
    torque: float


class Exchange(NamedTuple):
    """Result of one exchange.

    Attributes:
        readings: a reading of each drive, None where its answer is missing.
        fault: what is wrong, None while nothing is.
        periods: sampling periods since the last exchange, by the drives' own clock where they have one; with 0 the
            measurement belongs to the sample before, and is not to be published as another one.
    """

    readings: tuple[DriveReading | None, DriveReading | None]
    fault: Fault | None
    periods: int = 1

    @property
    def complete(self) -> bool:
        """Whether both drives have answered."""
        return None not in self.readings


class DriveInterface(Protocol):
    """Two drives on an open bus or port, without power until `enable`.

    Every method is for one thread. Torque other than zero is sent only while both drives are enabled.
    """

    @property
    def enabled(self) -> bool:
        """Whether both drives have been enabled and none has dropped out since."""
        ...

    @property
    def unused(self) -> Sequence[tuple[str, int]]:
        """Frames that were not used so far: why, and how many."""
        ...

    @property
    def notes(self) -> Sequence[str]:
        """Notes on the set-up for the operator."""
        ...

    def set_up(self) -> None:
        """Set up both drives, which stay without power.

        Raises:
            DriveError: a drive is missing, or cannot be set up.
        """
        ...

    def tend(self) -> None:
        """Do what is due at this time while nothing is exchanged; called often."""
        ...

    def confirm_start(self, timeout: float) -> None:
        """Confirm, where a posture is declared, that the robot stands where a run is to start.

        Raises:
            DriveError: it stands elsewhere, or does not answer within `timeout` (s).
        """
        ...

    def enable(self, timeout: float) -> None:
        """Enable both drives at zero torque.

        Raises:
            DriveError: a fault, or they are not enabled within `timeout` (s); they are off then.
        """
        ...

    def exchange(self) -> Exchange:
        """Exchange one cycle: measurements against the torques that were written last."""
        ...

    def write(self, torques: Torques, target: JointTarget | None = None) -> None:
        """Have both drives apply torques (Nm) from the next exchange on; zero unless both are enabled.

        With a target, drives that have an inner loop close it besides; without one there is none.

        Raises:
            ValueError: a torque is not finite; zero is applied instead.
        """
        ...

    def quick_stop(self) -> None:
        """Command zero torque and stop both drives in their own way."""
        ...

    def switch_off(self) -> None:
        """Remove power from both drives without waiting for it."""
        ...

    def disable(self, timeout: float) -> None:
        """Command zero torque, then switch both drives off in order.

        Raises:
            DriveError: they are not off within `timeout` (s).
        """
        ...

    def reset(self, timeout: float) -> None:
        """Reset the drives' faults; the drives stay off.

        Raises:
            DriveError: a fault is still there after `timeout` (s); the text says what clears it.
        """
        ...

    def release(self) -> None:
        """Release the drives, which are off."""
        ...

    def close(self) -> None:
        """Stop receiving and close the bus or the port."""
        ...


D = TypeVar("D", bound=DriveInterface)


def set_up_or_closed(drives: D) -> D:
    """Set up drives whose bus or port is open, and return them.

    Raises:
        DriveError: a drive cannot be set up; the bus or port is closed then.
    """
    try:
        drives.set_up()
    except DriveError:
        drives.close()
        raise
    return drives
