"""Base of the nodes that answer samples: joins inputs by exact stamp and answers each sample once."""

from __future__ import annotations

from abc import abstractmethod
from collections.abc import Callable, Sequence
from functools import partial
from typing import Annotated, Any, NamedTuple

from fivebar_description.interface import JOINT_SOURCES, Topic
from fivebar_description.joint_sample import JointSample, MessageError, part_of
from fivebar_description.outside_text import one_line
from fivebar_description.ros.messages import read_fields, stamp_of
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.stamp_join import CAPACITY, Arrival, Contradicted, StampJoin
from fivebar_description.settings import Setting
from fivebar_description.suggestion import expected_one_of

QUEUE_DEPTH = 2000
"""History depth of nodes outside of the control cycle: the run continues while such a node gets no processor time."""


def _unknown_states(names: tuple[str, ...]) -> str | None:
    states = [topic.name for topic in JOINT_SOURCES]
    unknown = [name for name in names if name not in states]
    return f"{unknown[0]!r}: {expected_one_of(unknown[0], states)}" if unknown else None


class ExternalInputs(NamedTuple):
    """The states that come from outside of the graph."""

    external_inputs: Annotated[
        tuple[str, ...],
        Setting(
            "Inputs that come from outside of the graph, on a topic where others may publish other joints. A remapping"
            " (-r joint_states:=...) says which topic that is.",
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


def fields_of(names: tuple[str, ...], *fields: str, allow_nan: bool = False) -> partial[tuple[tuple[float, ...], ...]]:
    """Return a reader of a JointState's fields, in the order of `names`."""
    return partial(read_fields, names=names, fields=fields, allow_nan=allow_nan)


class SamplingNode(GraphNode):
    """Joins inputs by stamp. The first input drives: its repeats are answered again, its sample 0 starts anew."""

    def __init__(self, name: str) -> None:
        """Make the node; subclasses add parameters and topics."""
        super().__init__(name)
        self._with_others: set[str] = set()
        if self.in_chain:
            self.external_inputs = self.declare_settings(ExternalInputs).external_inputs

    def join(self, rate_hz: int, inputs: Sequence[Input], depth: int | None = None) -> None:
        """Subscribe to the inputs, the driving one first; call once, after everything that answers is in place.

        `depth` is the history depth, for a node outside of the control cycle; by default that of the topic.
        """
        assert self.agreement is not None, "a node that answers samples belongs to a run"
        self._run = self.agreement
        self._run.on_begin = self._begin_epoch
        self.rate_hz = rate_hz
        self._join = StampJoin([one.topic.name for one in inputs], depth or CAPACITY)
        self._driver = inputs[0].topic
        # the driving input last: when its message arrives, the others of the sample are more likely to be there
        for one in (*inputs[1:], inputs[0]):
            self.listen(one.topic, self._receiver(one), depth)

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

    def own_part(self, topic: Topic, message: JointSample, names: tuple[str, ...]) -> JointSample | None:
        """Return the part of a message that is about the robot's own joints, None where it is about none of them.

        Joints that are left out, such as a gripper's, are logged once. Without any of its own joints a message is
        dropped, unless the topic comes from outside, where others may publish.
        """
        part = part_of(message, names)
        if part is None:
            if topic.name not in self.external_inputs:
                self.drop(topic, f"has none of {', '.join(names)}")
        elif len(message.name) > len(part.name) and topic.name not in self._with_others:
            self._with_others.add(topic.name)
            others = [name for name in message.name if name not in names]
            self.get_logger().info(f"{topic.name} has other joints, too: {one_line(', '.join(others))}")
        return part

    def _receiver(self, one: Input) -> Callable[[Any], None]:
        topic, read, later = one
        driving = topic is self._driver
        run, join = self._run, self._join
        names = read.keywords["names"] if topic.of_joints and isinstance(read, partial) else ()
        external = bool(names) and topic.name in self.external_inputs

        def receive(message: Any) -> None:
            if not run.holds or self.refuses(topic):
                return
            if external or (names and len(message.name) > len(names)):
                part = self.own_part(topic, message, names)
                if part is None:
                    return
                message = part
            sample = run.sample(stamp_of(message))
            if self.has_second_publisher(topic):
                if driving and sample is not None:
                    self.hold(sample)
                return
            if sample is None:
                self.drop(topic, f"stamp {stamp_of(message)} ns is not on the grid of {self.rate_hz} Hz")
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
                if external and sample > 0 and not join.repeats(topic.name, values):
                    self.contradicted(topic, f"sample {sample}")
                    return
                if driving and self.may_have_second_publisher:
                    self.hold(sample)
                elif driving:
                    self.repeat()
                return
            if arrival is Arrival.OLD:
                self._begin_run()
            if self.may_have_second_publisher:
                # its inputs are kept, for there may be none
                if driving:
                    self.hold(sample)
            elif not self.admit(sample, driving, values):
                return
            try:
                complete = join.put(topic.name, sample, values)
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
