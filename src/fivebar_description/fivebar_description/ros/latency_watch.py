# SPDX-License-Identifier: Apache-2.0
"""How long answers take, as a histogram of fixed size: nothing grows while a robot runs."""

from __future__ import annotations

BIN_MS = 0.02
BINS = 2500
"""Answers that take longer than BINS times BIN_MS share the last bin; the longest is kept besides."""


class LatencyWatch:
    """Collects times (s) from a question to its answer."""

    def __init__(self) -> None:
        """Begin without any."""
        self._bins = [0] * BINS
        self._count = 0
        self._longest = 0.0

    def note(self, seconds: float) -> None:
        """Note the time (s) that one answer took."""
        milliseconds = seconds * 1e3
        self._bins[min(int(milliseconds / BIN_MS), BINS - 1)] += 1
        self._count += 1
        self._longest = max(self._longest, milliseconds)

    def summary(self) -> dict[str, float] | None:
        """Return median, 99th percentile and maximum (ms), the first two rounded up to a bin; None without answers."""
        if self._count == 0:
            return None
        return {"p50": self._quantile(0.50), "p99": self._quantile(0.99), "max": self._longest}

    def _quantile(self, fraction: float) -> float:
        below = 0
        for number, count in enumerate(self._bins):
            below += count
            if below >= fraction * self._count:
                return min((number + 1) * BIN_MS, self._longest)
        return self._longest
