# SPDX-License-Identifier: Apache-2.0
"""The torque and the speed that a commissioning is allowed, kept at the drives whatever a step asks for."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from typing import NamedTuple

from fivebar_commission.step import GateClosed
from fivebar_control.hardware.drive_interface import ZERO, DriveInterface, Exchange, Torques
from fivebar_control.hardware.fault import DriveError
from fivebar_description.interrupts import interrupts_deferred

OFF_TIMEOUT = 2.0
"""Longest time (s) for taking the drives' power in order."""


class Allowed(NamedTuple):
    """Largest torque (Nm, at a joint) and speed (rad/s) of either motor."""

    torque: float
    speed: float


class AllowedDrives:
    """Two open drives that give no more than the allowed torque, and none once a motor is faster than allowed."""

    def __init__(self, drives: DriveInterface, allowed: Allowed) -> None:
        """Take over drives without power."""
        self._drives, self._allowed = drives, allowed
        self.largest_torque = self.largest_speed = 0.0
        """The largest torque (Nm) written and the largest speed (rad/s) seen."""

    def enable(self, timeout: float) -> None:
        """Enable both at zero torque.

        Raises:
            DriveError: they cannot be enabled.
        """
        self._drives.enable(timeout)

    def exchange(self) -> Exchange:
        """Exchange a cycle.

        Raises:
            GateClosed: a drive has a fault, or a motor is faster than allowed; both have no torque then.
        """
        exchange = self._drives.exchange()
        if exchange.fault is not None:
            self._drives.quick_stop()
            raise GateClosed(exchange.fault.name, exchange.fault.detail)
        speeds = [abs(reading.velocity) for reading in exchange.readings if reading is not None]
        self.largest_speed = max([self.largest_speed, *speeds])
        if self._drives.enabled and self.largest_speed > self._allowed.speed:
            self._drives.quick_stop()
            raise GateClosed(
                "over_speed", f"a motor turns at {self.largest_speed:.2f} rad/s, allowed are {self._allowed.speed:g}"
            )
        return exchange

    def write(self, torques: Torques) -> None:
        """Apply torques (Nm) from the next exchange on, limited to what is allowed."""
        if not all(map(math.isfinite, torques)):
            self._drives.write(ZERO)
            raise ValueError(f"torques {torques} Nm: expected finite numbers")
        limit = self._allowed.torque
        first, second = (max(-limit, min(limit, torque)) for torque in torques)
        self.largest_torque = max(self.largest_torque, abs(first), abs(second))
        self._drives.write((first, second))

    def disable(self) -> None:
        """Command zero torque and take the power."""
        self._drives.disable(OFF_TIMEOUT)

    @property
    def notes(self) -> list[str]:
        """Notes of the drives on their set-up."""
        return list(self._drives.notes)


@contextmanager
def without_torque_afterwards(drives: DriveInterface, allowed: Allowed) -> Iterator[AllowedDrives]:
    """Hand open drives to a block; however it ends, both are left without torque and power, and closed."""
    try:
        yield AllowedDrives(drives, allowed)
    finally:
        with interrupts_deferred():
            try:
                with suppress(ValueError):
                    drives.write(ZERO)
                if drives.enabled:
                    drives.disable(OFF_TIMEOUT)
            except DriveError:
                drives.switch_off()
            finally:
                drives.release()
                drives.close()
