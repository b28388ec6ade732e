# SPDX-License-Identifier: Apache-2.0
"""Watchdog over the inputs of the last node. Times are seconds of a steady clock, given by the caller.

That clock does not advance while the process is suspended: its deadlines would expire although no sender is late, and
messages that came in time are still queued. It continues from where the pause began, so that they can be processed
first. The pause of a node itself is detected by the nodes that wait for its answers.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from fivebar_control.fault import Fault

LONGEST_QUEUE = 16
"""Most samples that wait for inputs at the same time; older ones are discarded, as their inputs are."""

RECENT = 0.2
"""Time (s) within which a sample must have been complete for a reset, where the deadline is shorter."""


class Watchdog:
    """Monitors that joint states keep arriving, and that every sample gets its candidate torques."""

    def __init__(self, candidate_deadline: float, state_deadline: float, last_sample: int | None) -> None:
        """Make a watchdog.

        Args:
            candidate_deadline: longest wait (s) for the other inputs of a sample.
            state_deadline: longest time (s) from one sample to the next; inf where time does not pass by itself.
            last_sample: of the run, after which none is expected; None for a run without end.
        """
        self._candidate_deadline = candidate_deadline
        self._state_deadline = state_deadline
        self.last_sample = math.inf if last_sample is None else last_sample
        """After which no joint states are expected."""
        self._joined = False
        self.begin_run()

    def begin_run(self) -> None:
        """Reset the watchdog: a new run begins at sample 0."""
        self._waiting: dict[int, float] = {}
        self.newest = 0
        """The sample whose joint states arrived last."""
        self._received_at = 0.0
        self._complete = -math.inf

    def joined_late(self, sample: int) -> Fault | None:
        """Return `joined_late` for the first sample of all where it is not the first of the run, None else.

        A last node that was restarted during a run does not know what stopped the robot. In lockstep, nothing has moved
        since.
        """
        first, self._joined = not self._joined, True
        if not first or sample <= 1 or math.isinf(self._state_deadline):
            return None
        return Fault("joined_late", f"the first sample heard was {sample}, not the beginning of a run")

    def received(self, sample: int, now: float) -> None:
        """Register the joint states of a sample; its deadline runs from their first arrival."""
        self._waiting.setdefault(sample, now)
        if len(self._waiting) > LONGEST_QUEUE:
            del self._waiting[min(self._waiting)]
        self.newest, self._received_at = sample, now

    def rearm(self, now: float) -> None:
        """Restart the deadline of the next joint states."""
        self._received_at = now

    def completed(self, sample: int, now: float) -> None:
        """Register that all inputs of a sample have arrived."""
        self.answered(sample)
        self._complete = now

    def answered(self, sample: int) -> None:
        """Stop the deadlines of a sample and of those before it."""
        self._waiting = {number: since for number, since in self._waiting.items() if number > sample}

    def overdue(self, now: float) -> int | None:
        """Return the oldest sample whose deadline has expired, None without one.

        In real time sample 0 has no deadline: it is repeated, at zero torque, until it is answered.
        """
        real_time = not math.isinf(self._state_deadline)
        sample = min((number for number in self._waiting if number > 0 or not real_time), default=None)
        return sample if sample is not None and now - self._waiting[sample] >= self._candidate_deadline else None

    def missing(self, sample: int, inputs: list[str]) -> Fault:
        """Return the fault of an overdue sample."""
        limit = self._candidate_deadline * 1e3
        return Fault("candidate_missing", f"no {', '.join(inputs)} for sample {sample} within {limit:g} ms")

    def stale(self, now: float) -> Fault | None:
        """Return `state_stale` where the next joint states are overdue; sample 0 waits for the start of the run."""
        if not 0 < self.newest < self.last_sample or now - self._received_at < self._state_deadline:
            return None
        return Fault(
            "state_stale", f"no joint states after sample {self.newest} within {self._state_deadline * 1e3:g} ms"
        )

    def obstacle(self, now: float) -> str | None:
        """Return why a reset is refused for lack of a recent complete sample, None where there is one."""
        recent = max(self._candidate_deadline, RECENT)
        return None if now - self._complete < recent else f"no sample has been complete for {recent * 1e3:g} ms"


class PauseCompensatedClock:
    """The time (s) of a steady clock minus the pauses of the process, which has to read it periodically."""

    def __init__(self, steady: Callable[[], float], longest: float) -> None:
        """Start at the steady clock's time; the interval between two readings counts for `longest` (s) at most."""
        self._steady = steady
        self._longest = longest
        self._last = steady()
        self._paused = 0.0

    def read(self) -> float:
        """Return the time (s)."""
        now = self._steady()
        self._paused += max(0.0, now - self._last - self._longest)
        self._last = now
        return now - self._paused
