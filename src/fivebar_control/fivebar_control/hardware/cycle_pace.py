# SPDX-License-Identifier: Apache-2.0
"""The pace of cycles without a control law, such as while drives are being enabled, and periods that have passed."""

from __future__ import annotations

import math
import threading
import time


class CyclePace:
    """Waits from one cycle to the next."""

    def __init__(self, period: float) -> None:
        """Begin with a cycle at once; `period` is the time (s) between two."""
        self._period = period
        self._pause = threading.Event()
        self._next = 0.0

    def wait(self) -> None:
        """Wait until the next cycle is due."""
        now = time.monotonic()
        self._pause.wait(max(0.0, self._next - now))
        self._next = max(self._next, now) + self._period


EARLY = 0.05
"""Part of a period by which a cycle may come before its time and still count as the next one."""

FIRST = 5
"""Cycles, the late ones of which may be followed by one that is earlier by up to a period, and tells when cycles are
due. Later on one that is earlier by more than half a period comes in the same period as the one before."""


class CycleCount:
    """Counts the periods between cycles by the clock, so that those in which the machine stood still count too.

    Cycles come late, by almost a period too, and hardly ever early: the earliest one so far tells when they are due.
    One that comes in the same period as the one before has a number of its own, and the next missing period is not
    counted: the count never runs away from the clock.
    """

    def __init__(self, period: float) -> None:
        """Count periods of a length (s)."""
        self._period = period
        self._number = 0
        self._origin: float | None = None

    def passed(self, now: float) -> int:
        """Return how many periods have passed since the cycle before, at least one, for a cycle at a time (s)."""
        if self._origin is None:
            self._origin = now
            return 1
        before = self._number
        at = (now - self._origin) / self._period
        self._number = max(before + 1, math.floor(at + EARLY))
        if 0.0 < self._number - at < (1.0 if self._number < FIRST else 0.5):
            self._origin = now - self._number * self._period
        return self._number - before
