# SPDX-License-Identifier: Apache-2.0
"""Latency of the machine itself: an empty periodic loop at the control chain's priority."""

from __future__ import annotations

import os
import time
from typing import NamedTuple

from fivebar_description.interface import DEFAULT_PRIORITY


class Stalls(NamedTuple):
    """How a bare loop kept its time.

    Attributes:
        late: how often it woke after the next beat was due.
        prioritized: whether the system granted the priority.
        lateness_ms: times from when a beat was due to when the loop woke (ms).
        periods_ms: times from one beat to the next (ms).
    """

    late: int
    prioritized: bool
    lateness_ms: list[float]
    periods_ms: list[float]

    @property
    def name(self) -> str:
        """The measured quantity."""
        return f"bare loop at priority {DEFAULT_PRIORITY}" if self.prioritized else "bare loop without priority"


def bare_loop(rate_hz: int, beats: int, priority: int) -> Stalls:
    """Wake periodically at a rate (Hz) for a number of beats and measure the lateness; priority under SCHED_FIFO."""
    before = os.sched_getscheduler(0), os.sched_getparam(0)
    try:
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
        prioritized = True
    except OSError:
        prioritized = False
    period = 1.0 / rate_hz
    late = 0
    latenesses: list[float] = []
    periods: list[float] = []
    try:
        due = woke = time.monotonic()
        for _ in range(beats):
            due += period
            time.sleep(max(0.0, due - time.monotonic()))
            last, woke = woke, time.monotonic()
            periods.append((woke - last) * 1e3)
            lateness = woke - due
            latenesses.append(lateness * 1e3)
            if lateness > period:
                late += 1
                due = time.monotonic()
    finally:
        os.sched_setscheduler(0, *before)
    return Stalls(late, prioritized, latenesses, periods)
