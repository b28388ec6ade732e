# SPDX-License-Identifier: Apache-2.0
"""Assigns a measurement to its sample, by the clock of the board that made it."""

from __future__ import annotations

WRAP_US = 1 << 32
"""The board's clock starts again from 0 after so many us, 71.6 minutes."""

SLACK = 0.75
"""Part of a period by which a measurement may miss its place on the grid before another sample is taken for it: more
than half, so that measurements beside the middle of two places do not jump to and fro."""

TRACKING = 0.05
"""Part of the deviation by which the grid follows each measurement: two clocks differ, and drift."""


class SampleClock:
    """Counts sampling periods between measurements that are dated in us by a clock of 32 bits."""

    def __init__(self, period_us: int) -> None:
        self._period = period_us
        self._last: int | None = None
        self._ahead = 0.0

    def begin(self) -> None:
        """Forget all measurements: the next is the first."""
        self._last = None

    def periods(self, time_us: int) -> int:
        """Return the periods since the last sample, 0 for a measurement that belongs to the same."""
        if self._last is None:
            self._last, self._ahead = time_us, 0.0
            return 1
        self._ahead += ((time_us - self._last) % WRAP_US) / self._period
        self._last = time_us
        deviation = self._ahead - 1.0
        periods = 1 if abs(deviation) <= SLACK else max(0, round(self._ahead))
        self._ahead -= periods
        if periods:
            self._ahead *= 1.0 - TRACKING
        return periods
