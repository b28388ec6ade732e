# SPDX-License-Identifier: Apache-2.0
"""Base of the nodes that answer samples: joins inputs by exact stamp and answers each sample once."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from enum import Enum
from operator import attrgetter
from typing import Annotated, Any, NamedTuple

from fivebar_description.interface import JOINT_SOURCES, JOINT_STATE, Topic
from fivebar_description.joint_sample import MessageError
from fivebar_description.publishers import same
from fivebar_description.ros.messages import stamp_of
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_description.settings import Setting
from fivebar_description.suggestion import expected_one_of

QUEUE_DEPTH = 2000
"""History depth of nodes outside of the control cycle: the run continues while such a node gets no processor time."""

CAPACITY = 16
"""Samples that may wait for their other inputs, by default; the oldest is given up when more arrive."""

LEAP = 5000
"""A sample so many after the last one is taken for a wrong stamp, unless its like comes again: to believe a single one
would make every sample in between an old one."""


def _unknown_states(names: tuple[str, ...]) -> str | None:
    states = [topic.name for topic in JOINT_SOURCES]
    unknown = [name for name in names if name not in states]
    return f"{unknown[0]!r}: {expected_one_of(unknown[0], states)}" if unknown else None


class ExternalInputs(NamedTuple):
    """The states that come from outside of the graph."""

    external_inputs: Annotated[
        tuple[str, ...],
        Setting(
            "Inputs that come from outside of the graph: messages of other joints alone are then no mistake. A"
            " remapping (-r joint_states:=...) says which topic that is.",
            check=_unknown_states,
        ),
    ] = ()


class Input(NamedTuple):
    """One input.

    Attributes:
        topic: where it comes from.
        read: returns a message's values, or raises MessageError for a bad one.
        later: number of samples by which a message belongs to a later sample than that of its stamp; the first samples
            lack this input and get no answer.
    """

    topic: Topic
    read: Callable[[Any], Any]
    later: int = 0


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
            if self.last < 0 or sample - self.last <= LEAP:
                return Arrival.NEW
            before, self._leapt = self._leapt, sample
            # the second of its kind, one or a few later: the sender has gone on while this node was not looking
            return Arrival.NEW if before >= 0 and 0 < sample - before <= CAPACITY else Arrival.LEAP
        return Arrival.REPEATED if sample == self.last else Arrival.OLD

    def put(self, name: str, sample: int, value: Any) -> tuple[Any, ...] | None:
        """Take a value of a new sample; return all inputs in order when the sample is complete, else None.

        A complete sample counts as answered: it and all older ones are forgotten.

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
        self.last, self._completed = sample, waiting
        del self._open[sample]
        if self._open:
            for old in [number for number in self._open if number < sample]:
                del self._open[old]
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

    def forget(self) -> None:
        """Forget the samples that are not complete."""
        self._open.clear()

    def restart(self) -> None:
        """Forget everything: a new run begins at sample 0."""
        self._open.clear()
        self._completed = {}
        self.last = -1


class SamplingNode(GraphNode):
    """Joins inputs by stamp. The first input drives: its repeats are answered again, its sample 0 starts anew."""

    def __init__(self, name: str) -> None:
        """Make the node; subclasses add parameters and topics."""
        super().__init__(name)
        if self.in_chain:
            self.external_inputs = self.declare_settings(ExternalInputs).external_inputs

    def join(self, rate_hz: int, inputs: Sequence[Input], depth: int | None = None) -> None:
        """Subscribe to the inputs, the driving one first; call once, after everything that answers is in place.

        `depth` is the history depth, for a node outside of the control cycle; by default that of the topic.
        """
        assert isinstance(self.agreement, RunAgreement), "a node that answers samples belongs to a run"
        self._run = self.agreement
        self._run.on_begin = self._begin_epoch
        self.rate_hz = rate_hz
        self._join = StampJoin([source.topic.name for source in inputs], depth or CAPACITY)
        self._driver = inputs[0].topic
        # the driving input last: when its message arrives, the others of the sample are more likely to be there
        for source in (*inputs[1:], inputs[0]):
            self.listen(source.topic, self._receiver(source), depth)

    @abstractmethod
    def answer(self, sample: int, *values: Any) -> None:
        """Answer a sample whose inputs are complete, in the order in which they were declared."""

    def repeat(self) -> None:
        """Answer the last sample again: its driving message was repeated, so the answer may have been lost."""

    def hold(self, sample: int) -> None:
        """Answer a sample as it is safe, since its inputs may be those of a second publisher; it is answered once."""

    def forget(self) -> None:
        """Forget the inputs of samples that are not complete."""
        self._join.forget()

    def restart(self) -> None:
        """Reset the state: the driving input starts a new run at sample 0."""

    def admit(self, sample: int, driving: bool, values: Any) -> bool:
        """Inspect an input of a new sample and its values before it is joined; False discards it."""
        return True

    @property
    def last_sample(self) -> int:
        """The sample that was answered last, -1 before the first."""
        return self._join.last

    def missing_inputs(self, sample: int) -> list[str]:
        """Return the topics that an open sample still lacks."""
        return self._join.missing(sample)

    def waiting_samples(self, topic: Topic) -> int:
        """Return how many samples wait for a topic."""
        return self._join.waiting(topic.name)

    def _receiver(self, source: Input) -> Callable[[Any], None]:
        topic, read, later = source
        driving, name = topic is self._driver, topic.name
        run, join, watch = self._run, self._join, self._watch
        external = name in self.external_inputs
        stamp_of_one: Callable[[Any], int] = attrgetter("stamp_ns") if topic.type == JOINT_STATE else stamp_of

        def receive(message: Any) -> None:
            if not run.holds or self.refuses(topic):
                return
            stamp = stamp_of_one(message)
            sample = run.sample(stamp)
            if watch.conflicts and self.has_second_publisher(topic):
                if driving and sample is not None:
                    self.hold(sample)
                return
            if sample is None:
                self.drop(topic, f"stamp {stamp} ns is not on the grid of {self.rate_hz} Hz")
                return
            sample += later
            arrival = join.arrival(sample)
            if arrival is Arrival.OLD and not (driving and sample == 0):
                self.drop(topic, f"old stamp of sample {sample}, expected one after {join.last}")
                return
            if arrival is Arrival.LEAP:
                self.drop(topic, f"stamp of sample {sample} is far after that of sample {join.last}")
                return
            try:
                values = read(message)
            except MessageError as error:
                self.drop(topic, str(error))
                return
            if arrival is Arrival.REPEATED:
                # a second source of a state from outside shows in this only; sample 0 is measured anew until answered
                if external and sample > 0 and not join.repeats(name, values):
                    self.contradicted(topic, f"sample {sample}")
                    return
                if driving and watch.pending:
                    self.hold(sample)
                elif driving:
                    self.repeat()
                return
            if arrival is Arrival.OLD:
                self._begin_run()
            if watch.pending:
                # its inputs are kept, for there may be none
                if driving:
                    self.hold(sample)
            elif not self.admit(sample, driving, values):
                return
            try:
                complete = join.put(name, sample, values)
            except Contradicted:
                # sample 0 is measured anew until it is answered
                if not driving or sample > 0:
                    self.contradicted(topic, f"sample {sample}")
                return
            if complete is not None:
                self.answer(sample, *complete)
                self.note_answer()

        return receive

    def _begin_epoch(self) -> None:
        """Start anew with other numbers: samples that were admitted, answered or not, had those of another epoch."""
        if self._join.last < 0:
            self.restart()
        self._begin_run()

    def _begin_run(self) -> None:
        """Start anew: the driving input is at sample 0 again, or a run with another epoch begins."""
        begun = self._join.last >= 0
        self._join.restart()
        if begun:
            self.note_pause()
            self.restart()
