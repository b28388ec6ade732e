# SPDX-License-Identifier: Apache-2.0
"""Latency of the machine itself: an empty periodic loop at the control chain's priority.

`python bench/stalls.py RATE` runs one until SIGTERM, and prints when it stalled.
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
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


class LateBeat(NamedTuple):
    """When a beat of a bare loop was due and when the loop woke, by the clock that stamps are taken from (ns)."""

    due: int
    woke: int


@contextmanager
def bare_loop_beside(rate_hz: int) -> Iterator[list[LateBeat]]:
    """Run a bare loop in a process of its own meanwhile; the beats that it missed are in the list afterwards."""
    stalls: list[LateBeat] = []
    loop = subprocess.Popen([sys.executable, __file__, str(rate_hz)], stdout=subprocess.PIPE, text=True)
    assert loop.stdout is not None
    loop.stdout.readline()
    try:
        yield stalls
    finally:
        loop.send_signal(signal.SIGTERM)
        output, _ = loop.communicate()
    stalls += [LateBeat(*one) for one in json.loads(output)]


def missed_by_both(missing: Sequence[int], stalls: Sequence[LateBeat], period: int) -> int:
    """Return how many of the missing samples, by stamp (ns), fall within a period (ns) of a stall of a bare loop."""
    return sum(any(one.due - period <= stamp <= one.woke + period for one in stalls) for stamp in missing)


def stalls_until_stopped(rate_hz: int) -> list[LateBeat]:
    """Run a bare loop until SIGTERM; return the beats that it missed."""
    stopped: list[int] = []
    signal.signal(signal.SIGTERM, lambda number, _: stopped.append(number))
    with suppress(OSError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(DEFAULT_PRIORITY))
    print("begun", flush=True)
    stalls, period, due = [], 1.0 / rate_hz, time.monotonic()
    while not stopped:
        due += period
        time.sleep(max(0.0, due - time.monotonic()))
        late = time.monotonic() - due
        if late > period:
            now = time.time_ns()
            stalls.append(LateBeat(now - round(late * 1e9), now))
            due += late
    return stalls


if __name__ == "__main__":
    print(json.dumps(stalls_until_stopped(int(sys.argv[1]))))
