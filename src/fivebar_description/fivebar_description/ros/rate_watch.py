"""How evenly a node answers: intervals between its answers, summed up without keeping them."""

from __future__ import annotations

import math
from typing import NamedTuple


class RateStatistics(NamedTuple):
    """What a stretch of time held.

    Attributes:
        answers: number of answers.
        rate_hz: answers per second, 0 without two of them.
        jitter_ms: standard deviation of the intervals between answers (ms).
        interval_max_ms: longest interval (ms).
        late: intervals longer than the limit.
    """

    answers: int
    rate_hz: float
    jitter_ms: float
    interval_max_ms: float
    late: int


class RateWatch:
    """Watches intervals (s of a steady clock, given by the caller)."""

    def __init__(self, late_after: float = math.inf) -> None:
        """Count intervals longer than `late_after` (s) as late."""
        self._late_after = late_after
        self._last: float | None = None
        self.late = 0
        """Late intervals since the beginning."""
        self._begin()

    def _begin(self) -> None:
        self._count = self._late = 0
        self._sum = self._squares = self._longest = 0.0

    def note(self, now: float) -> None:
        """Note an answer."""
        if self._last is not None:
            interval = now - self._last
            self._count += 1
            self._sum += interval
            self._squares += interval * interval
            self._longest = max(self._longest, interval)
            if interval > self._late_after:
                self._late += 1
                self.late += 1
        self._last = now

    def pause(self) -> None:
        """Do not count the time until the next answer as an interval."""
        self._last = None

    def take(self) -> RateStatistics:
        """Return what has been since the last call, and begin anew."""
        if self._count == 0:
            rates = RateStatistics(0, 0.0, 0.0, 0.0, 0)
        else:
            mean = self._sum / self._count
            spread = math.sqrt(max(0.0, self._squares / self._count - mean * mean))
            rates = RateStatistics(
                self._count, 1.0 / mean if mean > 0.0 else 0.0, spread * 1e3, self._longest * 1e3, self._late
            )
        self._begin()
        return rates
