# SPDX-License-Identifier: Apache-2.0
"""Whether a controller holds a torque that nobody renews, without ROS. Times are seconds of the steady clock."""

from __future__ import annotations

from collections.abc import Sequence


class HeldCommand:
    """The command that a controller holds, and since when.

    It is guarded from when the bridge says that the drives follow until no torque is held and it no longer says so:
    others may command the controller then.
    """

    def __init__(self, timeout: float) -> None:
        """Hold no torque; the longest time (s) for which one holds that is not renewed."""
        self._timeout = timeout
        self._torque = self._follows = self._guarded = False
        self._came = 0.0

    @property
    def holds_torque(self) -> bool:
        """Whether the controller holds a torque that the bridge is to renew."""
        return self._guarded and self._torque

    def follow(self, follows: bool) -> None:
        """Take whether the bridge says that the drives follow its torques."""
        self._follows = follows
        self._guarded = follows or self.holds_torque

    def take(self, torques: Sequence[float], now: float) -> None:
        """Take a command that was published, by whomever."""
        self._torque, self._came = any(torques), now
        self._guarded = self._follows or self.holds_torque

    def overdue(self, now: float) -> float | None:
        """Return the age (s) of a torque that has not been renewed in time, None where there is none."""
        age = now - self._came
        return age if self.holds_torque and age > self._timeout else None
