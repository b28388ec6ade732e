# SPDX-License-Identifier: Apache-2.0
"""The reference after a fault: where the robot stands, at rest, and after the reset where it stood then."""

from __future__ import annotations

from fivebar_control.model.state import Platform


class Hold:
    """Follows the state of the safety stage, and gives the resting reference where it holds the robot.

    While the robot is stopped the reference is the measured place, so no tracking error builds up. With the
    reset it is frozen: the torque starts from no error. It stays there, since the plan's moment has passed, until a
    requested motion begins there.
    """

    def __init__(self) -> None:
        """Make one for a robot that may move."""
        self._stopped = False
        self._place: tuple[float, float] | None = None

    def begin_run(self) -> None:
        """Begin a new run: its plan holds again, unless the robot is stopped."""
        self._place = None

    def stop(self) -> None:
        """Take note that a fault is latched."""
        self._stopped = True

    def release(self) -> None:
        """Take note that no fault is latched any more."""
        self._stopped = False

    @property
    def follows(self) -> bool:
        """Whether the reference follows the measured place."""
        return self._stopped

    def left_at(self) -> tuple[float, float] | None:
        """Return where (m) a reset has left the robot, once; None where no fault held it."""
        if self._stopped or self._place is None:
            return None
        place, self._place = self._place, None
        return place

    def reference(self, x: float, y: float) -> Platform | None:
        """Return the resting reference for a platform that was measured at (x, y) m; None where the plan holds."""
        if self._stopped:
            self._place = (x, y)
        return None if self._place is None else Platform(*self._place, 0.0, 0.0, 0.0, 0.0)
