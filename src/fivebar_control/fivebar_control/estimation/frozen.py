"""Detection of a frozen encoder: its reading is constant although the motor must be turning.

A constant reading is no fault by itself: at rest, and where a motor reverses, the angle is within the same count for
many samples, and the filter predicts it there, too. Where the predictions keep differing from a constant reading, the
encoder is frozen.
"""

from __future__ import annotations

from fivebar_control.estimation.ekf import Estimate
from fivebar_control.model.geometry import inverse_geometry, wrap
from fivebar_description.parameters import FiveBar

FEWEST = 3
"""Readings in a row that are the same before an encoder is suspected."""

LONGEST = 10
"""Readings in a row over which the differences are summed: half a count at rest must not accumulate for ever."""

COUNTS = 10.0
ANGLE = 1e-3
"""An encoder is frozen when the differences from the predictions sum to this many counts and this angle (rad)."""


class FrozenWatch:
    """Compares both motors' readings with the filter's predictions."""

    def __init__(self, robot: FiveBar, mode1: int, mode2: int, count: float) -> None:
        """Make a watch for encoders with counts of a size (rad), 0 for exact ones."""
        self._robot = robot
        self._modes = mode1, mode2
        self._limit = COUNTS * count + ANGLE
        self._last: tuple[float, float] | None = None
        self._stays = [1, 1]
        self._beyond = [0.0, 0.0]

    def check(self, readings: tuple[float, float], expected: Estimate, gap: bool) -> str | None:
        """Return the fault in words, None for none.

        Args:
            readings: of both motors (rad); call it once per sample.
            expected: the prediction for them.
            gap: whether readings before these were lost, over which the prediction is a guess.
        """
        last, self._last = self._last, readings
        if last is None or gap:
            self._stays, self._beyond = [1, 1], [0.0, 0.0]
            return None
        angles: tuple[float, ...] | None = None
        for motor, name in enumerate(("q11", "q21")):
            if readings[motor] != last[motor]:
                self._stays[motor], self._beyond[motor] = 1, 0.0
                continue
            self._stays[motor] += 1
            if self._stays[motor] > LONGEST:
                continue
            if angles is None:
                angles = inverse_geometry(self._robot, *self._modes, expected.x, expected.y)
            self._beyond[motor] += abs(wrap(angles[2 * motor] - readings[motor]))
            if self._stays[motor] >= FEWEST and self._beyond[motor] > self._limit:
                return (
                    f"{name} has read the same {self._stays[motor]} times, while the motion is"
                    f" {self._beyond[motor] / (self._stays[motor] - 1):.4f} rad away from it"
                )
        return None
