"""Joining of messages that answer the same sample."""

from __future__ import annotations

from collections.abc import Sequence
from enum import Enum
from typing import Any

from fivebar_description.publishers import same

CAPACITY = 16
"""Samples that may wait for their other inputs, by default; the oldest is given up when more arrive."""

LEAP = 5000
"""A sample so many after the last one is taken for a wrong stamp, unless its like comes again: to believe a single one
would make every sample in between an old one."""


class Arrival(Enum):
    """Kinds of messages: of a sample still open, of the one answered last, of an older one, or a leap."""

    NEW = 0
    REPEATED = 1
    OLD = 2
    LEAP = 3


class Contradicted(ValueError):
    """Two different values of one input have come for one sample."""


class StampJoin:
    """Collects one value of every input for each sample number, and hands them out once they are complete.

    The first value of an input for a sample counts. Another one is never taken in its place: it raises `Contradicted`.
    """

    def __init__(self, inputs: Sequence[str], capacity: int = CAPACITY) -> None:
        """Make a join of named inputs, in which so many samples may wait."""
        self._inputs = tuple(inputs)
        self._capacity = capacity
        self._open: dict[int, dict[str, Any]] = {}
        self._completed: dict[str, Any] = {}
        self.last = -1
        """The sample that was completed last, -1 before the first."""
        self._leapt = -1

    def arrival(self, sample: int) -> Arrival:
        """Return which kind of message one of this sample is."""
        if sample > self.last:
            return Arrival.LEAP if self._leaps(sample) else Arrival.NEW
        return Arrival.REPEATED if sample == self.last else Arrival.OLD

    def _leaps(self, sample: int) -> bool:
        if self.last < 0 or sample - self.last <= LEAP:
            return False
        before, self._leapt = self._leapt, sample
        # the second of its kind, one or a few later: the sender has gone on while this node was not looking
        return not (before >= 0 and 0 < sample - before <= CAPACITY)

    def put(self, name: str, sample: int, value: Any) -> tuple[Any, ...] | None:
        """Take a value of a new sample; return all inputs in order when the sample is complete, else None.

        Raises:
            Contradicted: another value of the input has come for this sample before.
        """
        waiting = self._open.setdefault(sample, {})
        if name in waiting:
            if not same(waiting[name], value):
                raise Contradicted
            return None
        waiting[name] = value
        if len(waiting) < len(self._inputs):
            if len(self._open) > self._capacity:
                del self._open[min(self._open)]
            return None
        self.close(sample)
        self._completed = waiting
        return tuple([waiting[name] for name in self._inputs])

    def repeats(self, name: str, value: Any) -> bool:
        """Return whether a value is the one with which the sample that was completed last was answered."""
        return name not in self._completed or same(self._completed[name], value)

    def missing(self, sample: int) -> list[str]:
        """Return the inputs that an open sample still lacks."""
        waiting = self._open.get(sample, {})
        return [name for name in self._inputs if name not in waiting]

    def waiting(self, name: str) -> int:
        """Return how many open samples lack an input."""
        return sum(name not in values for values in self._open.values())

    def close(self, sample: int) -> None:
        """Count a sample as answered, and forget it and all older ones."""
        self.last = sample
        self._completed = {}
        self._open.pop(sample, None)
        if self._open:
            for old in [number for number in self._open if number < sample]:
                del self._open[old]

    def forget(self) -> None:
        """Forget the samples that are not complete."""
        self._open.clear()

    def restart(self) -> None:
        """Forget everything: a new run begins at sample 0."""
        self._open.clear()
        self._completed = {}
        self.last = -1
