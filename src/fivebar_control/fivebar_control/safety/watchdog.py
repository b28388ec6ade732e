"""Whether what the last node works from is fresh. Times are seconds of a steady clock, given by the caller."""

from __future__ import annotations

import math

from fivebar_control.fault import Fault

LONGEST_QUEUE = 16
"""Samples that are waited for at once; older ones are given up, as their inputs are."""

RECENT = 0.2
"""Time (s) within which a sample must have been complete for a reset, where the deadline is shorter."""


class Freshness:
    """Watches that joint states keep coming, and that every sample gets its candidates."""

    def __init__(self, candidate_deadline: float, state_deadline: float, last_sample: int | None) -> None:
        """Make a watch.

        Args:
            candidate_deadline: longest wait (s) for the other inputs of a sample.
            state_deadline: longest time (s) from one sample to the next; inf where time may stand still.
            last_sample: of the run, after which none is missed; None for a run without end.
        """
        self._candidate_deadline = candidate_deadline
        self._state_deadline = state_deadline
        self._last_sample = math.inf if last_sample is None else last_sample
        self._joined = False
        self.begin_run()

    def begin_run(self) -> None:
        """Forget the past: a new run begins at sample 0."""
        self._waiting: dict[int, float] = {}
        self.newest = 0
        """The sample whose joint states came last."""
        self._heard = 0.0
        self._complete = -math.inf

    def joined_late(self, sample: int) -> Fault | None:
        """Return `joined_late` for the first sample of all where it is not the first of the run, None else.

        A last node that was started again in the middle does not know what stopped the robot. Where time waits for the
        torques, nothing has moved since.
        """
        first, self._joined = not self._joined, True
        if not first or sample <= 1 or math.isinf(self._state_deadline):
            return None
        return Fault("joined_late", f"the first sample heard was {sample}, not the beginning of a run")

    def heard(self, sample: int, now: float) -> None:
        """Take note of the joint states of a sample; it waits from its first arrival on."""
        self._waiting.setdefault(sample, now)
        if len(self._waiting) > LONGEST_QUEUE:
            del self._waiting[min(self._waiting)]
        self.newest, self._heard = sample, now

    def pardon(self, now: float) -> None:
        """Wait for the next joint states from now on."""
        self._heard = now

    def completed(self, sample: int, now: float) -> None:
        """Take note that all inputs of a sample are there."""
        self.answered(sample)
        self._complete = now

    def answered(self, sample: int) -> None:
        """Wait no longer for a sample and those before it."""
        self._waiting = {number: since for number, since in self._waiting.items() if number > sample}

    def overdue(self, now: float) -> int | None:
        """Return the oldest sample that has waited too long, None without one.

        In real time sample 0 may wait: it is repeated, at zero torque, until it is answered.
        """
        patient = not math.isinf(self._state_deadline)
        sample = min((number for number in self._waiting if number > 0 or not patient), default=None)
        return sample if sample is not None and now - self._waiting[sample] >= self._candidate_deadline else None

    def missing(self, sample: int, inputs: list[str]) -> Fault:
        """Return the fault of an overdue sample."""
        limit = self._candidate_deadline * 1e3
        return Fault("candidate_missing", f"no {', '.join(inputs)} for sample {sample} within {limit:g} ms")

    def stale(self, now: float) -> Fault | None:
        """Return `state_stale` where the next joint states are overdue. Sample 0 waits for the start of the run."""
        if not 0 < self.newest < self._last_sample or now - self._heard < self._state_deadline:
            return None
        return Fault(
            "state_stale", f"no joint states after sample {self.newest} within {self._state_deadline * 1e3:g} ms"
        )

    def obstacle(self, now: float) -> str | None:
        """Return why no sample has been complete of late, None where one has."""
        recent = max(self._candidate_deadline, RECENT)
        return None if now - self._complete < recent else f"no sample has been complete for {recent * 1e3:g} ms"
