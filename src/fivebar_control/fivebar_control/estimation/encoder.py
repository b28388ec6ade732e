"""What a reading of an incremental encoder says about the angle, and how surely.

The encoder rounds down to a count. A reading that has just changed says more than a single one: the angle crossed the
count's edge within the last period. A reading that stays says less each time: its error is the same as before, and a
filter that took it for a new one would grow sure of it. On the locus, where the motors turn round, half a count is a
millimetre of the platform.
"""

from __future__ import annotations

import math
from typing import NamedTuple

EXACT_ANGLE = 1e-6
"""Standard deviation (rad) that is assumed of an encoder without counts."""

LEAST_TRAVEL = 0.2
"""Least travel since the edge that is assumed, in counts: the speed from which it follows is an estimate."""

LONGEST_STAY = 20
"""Samples of one reading after which it is not trusted less any more."""


class Angle(NamedTuple):
    """An angle (rad) and its variance (rad^2)."""

    value: float
    variance: float


class CountedAngle:
    """One motor's encoder over a run."""

    def __init__(self, counts: int | None, rate_hz: int) -> None:
        """Make it for so many counts per revolution, None for exact angles."""
        self.count = 0.0 if counts is None else 2.0 * math.pi / counts
        """Angle of a count (rad)."""
        self._rate_hz = rate_hz
        self._last: float | None = None
        self._stay = 1

    def first(self, reading: float) -> Angle:
        """Return what the first reading (rad) says: uniformly distributed over the count above it."""
        self._last, self._stay = reading, 1
        return self._uniform(reading, 1.0)

    def next(self, reading: float, speed: float) -> Angle:
        """Return what the next reading (rad) says, at an expected speed (rad/s)."""
        if self.count == 0.0:
            return Angle(reading, EXACT_ANGLE * EXACT_ANGLE)
        last, self._last = self._last, reading
        if last is None or reading == last:
            self._stay = min(self._stay + 1, LONGEST_STAY)
            return self._uniform(reading, float(self._stay))
        self._stay = 1
        travel = min(1.0, max(LEAST_TRAVEL, abs(speed) / (self._rate_hz * self.count)))
        if reading > last:
            return Angle(reading + 0.5 * travel * self.count, (travel * self.count) ** 2 / 12.0)
        return Angle(reading + (1.0 - 0.5 * travel) * self.count, (travel * self.count) ** 2 / 12.0)

    def _uniform(self, reading: float, samples: float) -> Angle:
        variance = max(self.count * self.count / 12.0, EXACT_ANGLE * EXACT_ANGLE)
        return Angle(reading + 0.5 * self.count, variance * samples)
