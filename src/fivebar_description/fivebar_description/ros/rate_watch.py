# SPDX-License-Identifier: Apache-2.0
"""How evenly a node answers: intervals between its answers, summed up without keeping them."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting


class RateStatistics(NamedTuple):
    """Statistics of a stretch of time.

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


class DiagnosticThresholds(NamedTuple):
    """When a node warns on /diagnostics; every node has these parameters."""

    warn_below_hz: Annotated[
        float, Setting("Warn below this rate of answers, 0 for never.", "Hz", at_least=0.0, at_most=1e5)
    ] = 0.0
    warn_jitter_ms: Annotated[
        float, Setting("Warn above this jitter of the answers, 0 for never.", "ms", at_least=0.0, at_most=1e5)
    ] = 0.0
    late_after_ms: Annotated[
        float,
        Setting(
            "Interval between two answers beyond which the second is late, 0 for none.",
            "ms",
            at_least=0.0,
            at_most=1e5,
        ),
    ] = 0.0
    warn_late: Annotated[
        int, Setting("Warn above this number of late answers in a second.", at_least=0, at_most=100_000)
    ] = 0
    warn_dropped: Annotated[
        int, Setting("Warn above this number of dropped messages since the start.", at_least=0, at_most=1_000_000)
    ] = 0

    def timing_problem(self, rates: RateStatistics) -> str | None:
        """Return how the answers miss the thresholds, None where they do not or where there are none."""
        if rates.answers == 0:
            return None
        if rates.rate_hz < self.warn_below_hz:
            return f"slow: {rates.rate_hz:.1f} answers per second, expected {self.warn_below_hz:g}"
        if 0.0 < self.warn_jitter_ms < rates.jitter_ms:
            return f"uneven: jitter {rates.jitter_ms:.2f} ms, limit {self.warn_jitter_ms:g} ms"
        if rates.late > self.warn_late:
            return f"late: {rates.late} of {rates.answers} answers, limit {self.warn_late}"
        return None


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
            if interval > self._longest:
                self._longest = interval
            if interval > self._late_after:
                self._late += 1
                self.late += 1
        self._last = now

    def pause(self) -> None:
        """Do not count the time until the next answer as an interval."""
        self._last = None

    def take(self) -> RateStatistics:
        """Return the statistics since the last call, and begin anew."""
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
