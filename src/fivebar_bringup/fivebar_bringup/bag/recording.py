# SPDX-License-Identifier: Apache-2.0
"""A bag in memory: log times, stamps and values of each topic as numpy arrays."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np

from fivebar_bringup.bag.definitions import TYPESTORE, absolute_name
from fivebar_bringup.errors import BagError
from fivebar_description.interface import (
    EXTRA_READINGS,
    IMU_DATA,
    JOINT_STATES,
    MOTOR_STATES,
    NANOSECONDS,
    PASSIVE_STATES,
    RUN_EPOCH,
    START_STAMP_NS,
    VISION_PLATFORM,
    Topic,
    sample_of_stamp,
    torque_topic,
)
from fivebar_description.joint_sample import MessageError
from fivebar_description.run_plan import read_epoch
from fivebar_description.topic_contents import SEQUENCES, belongs, content_of

T = TypeVar("T")

FloatArray: TypeAlias = np.ndarray[tuple[int, ...], np.dtype[np.float64]]
IntArray: TypeAlias = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

OWN_CLOCK = frozenset(topic.name for topic in (IMU_DATA, PASSIVE_STATES, EXTRA_READINGS, VISION_PLATFORM))
"""Topics of sensors with clocks of their own, whose jitter makes neighbouring stamps change places."""

OWN_CLOCK_JITTER_NS = 50_000_000
"""Time (ns) by which such stamps may go back."""

WAS_SET = "was a clock set while it was recorded?"

LARGEST_LEAP_NS = 500_000_000
"""Time (ns) by which stamps may advance more than what passes meanwhile; in lockstep they are faster than the clock."""

_JOINT_STATE = "sensor_msgs/msg/JointState"
_IMU = "sensor_msgs/msg/Imu"
_FLOAT64 = "std_msgs/msg/Float64"
_STRING = "std_msgs/msg/String"
_VECTORS = {"orientation": "xyzw", "angular_velocity": "xyz", "linear_acceleration": "xyz"}


class RawTopic(NamedTuple):
    """One topic as recorded: its type, log times in nanoseconds and serialized messages, both in log-time order."""

    type: str
    log_times: list[int]
    messages: list[bytes]


class Decoded(NamedTuple):
    """The messages of a topic that belong to it, where each stands among the raw ones, and how many do not."""

    messages: list[Any]
    places: list[int]
    strays: int


class Recording:
    """The content of a bag. A topic is decoded on first access.

    Every accessor takes a topic of the graph's interface and raises :class:`BagError` if the bag does not have the
    topic or has it with another type, if no message can be decoded, or if the topic has no such content. A topic
    without messages gives empty arrays.

    Whoever can publish on a topic is recorded too. Messages that cannot be decoded, or have other names, lengths or
    stamps than the topic's, are left out as strays, as long as others belong to it. Those of other joints than the
    robot's are left out and are none.
    """

    def __init__(
        self, path: Path, topics: Mapping[str, RawTopic], custom_data: Mapping[str, str], namespace: str = ""
    ) -> None:
        """Keep the raw `topics` by absolute name; accessors look topics up in `namespace`."""
        self.path = path
        self.custom_data = custom_data
        """Custom data from metadata.yaml, e.g. the number of dropped messages; empty if the recorder was killed."""
        self._topics = topics
        self._namespace = namespace
        self._decoded: dict[str, Decoded] = {}

    @property
    def topics(self) -> tuple[str, ...]:
        """Absolute names of all topics in the bag."""
        return tuple(self._topics)

    def torque_candidates(self) -> tuple[Topic, ...]:
        """Return the topics with messages on which laws have published their candidate torques."""
        prefix, suffix = f"{self._namespace}/", torque_topic("").name
        names = (
            name.removeprefix(prefix)
            for name, raw in self._topics.items()
            if name.startswith(prefix) and name.endswith(suffix) and raw.type == _JOINT_STATE and raw.messages
        )
        laws = (name.removesuffix(suffix) for name in sorted(names))
        return tuple(torque_topic(law) for law in laws if law and "/" not in law)

    def count(self, topic: Topic) -> int:
        """Return the number of messages of a topic; 0 also if the bag does not have it."""
        raw = self._topics.get(absolute_name(topic, self._namespace))
        return len(raw.messages) if raw else 0

    def log_times(self, topic: Topic) -> IntArray:
        """Return when each message was recorded, int64[n] in nanoseconds."""
        times = self._raw(topic).log_times
        if topic.type in (_JOINT_STATE, _STRING):
            times = [times[place] for place in self._decode(topic).places]
        return np.array(times, dtype=np.int64)

    @property
    def strays(self) -> int:
        """How many messages are left out, of the topics that have been read so far."""
        return sum(decoded.strays for decoded in self._decoded.values())

    def stamps(self, topic: Topic) -> IntArray:
        """Return the stamps in the messages' headers, int64[n] in nanoseconds."""
        messages = self._messages(topic)
        try:
            stamps = [message.header.stamp for message in messages]
        except AttributeError:
            raise self._error(topic, "its messages have no stamp") from None
        return np.array([stamp.sec * NANOSECONDS + stamp.nanosec for stamp in stamps], dtype=np.int64)

    def clock_step(self, topic: Topic) -> str | None:
        """Return in words where the stamps of measurements do not rise with time, None where they do.

        A message that is published again is no further measurement, nor is the first sample until it is answered.
        """
        stamps, times = self.stamps(topic), self.log_times(topic)
        forward, passed = np.diff(stamps), np.diff(times)
        usual = float(np.median(forward[forward > 0])) if np.any(forward > 0) else 0.0
        back = np.flatnonzero(forward < -(OWN_CLOCK_JITTER_NS if topic.name in OWN_CLOCK else 0))
        leaps = np.flatnonzero(forward - passed > LARGEST_LEAP_NS)
        same = np.flatnonzero((forward == 0) & (stamps[1:] != stamps[:1]))
        repeated = [row for row in same.tolist() if self._message(topic, row) != self._message(topic, row + 1)]
        steps = []
        for row in back[:1].tolist():
            by = (usual - forward[row]) / NANOSECONDS
            steps.append((row, f"its stamps go back by {by:.3f} s", WAS_SET))
        for row in leaps[:1].tolist():
            by, apart = (forward[row] - usual) / NANOSECONDS, passed[row] / NANOSECONDS
            steps.append(
                (row, f"its stamps go forward by {by:.3f} s between two messages {apart:.3f} s apart", WAS_SET)
            )
        for row in repeated[:1]:
            words = f"{len(repeated)} of {len(stamps)} messages repeat the stamp before with other values"
            steps.append((row, words, "expected a stamp for each reading"))
        if not steps:
            return None
        row, words, advice = min(steps)
        return f"/{topic.name}: {words}, {(stamps[row] - stamps[0]) / NANOSECONDS:.3f} s after the first: {advice}"

    def refuse_clock_steps(self, *topics: Topic) -> None:
        """Raise where the stamps of one of some topics, as far as the bag has them, do not rise with time.

        Raises:
            BagError: they do not.
        """
        for topic in topics:
            if self.count(topic) and (step := self.clock_step(topic)) is not None:
                raise BagError(self.path, step)

    def epoch_ns(self, rate_hz: int) -> int:
        """Return the stamp (ns) of sample 0: that of the last run in the bag.

        Any program can announce an epoch. That of a run is one at which its samples, `rate_hz` of them in a second,
        begin: no sample was recorded one period before. Where the first one is missing, some others must be there.
        """
        if not self.count(RUN_EPOCH):
            return START_STAMP_NS
        announced = [text for text in self.read_texts(RUN_EPOCH, read_epoch) if text is not None][::-1]
        sources = [topic for topic in (MOTOR_STATES, JOINT_STATES) if self.count(topic)]
        stamps = set(self.stamps(sources[0]).tolist()) if sources else set()
        period = NANOSECONDS // rate_hz
        begun = [epoch for epoch in announced if epoch - period not in stamps]
        numbered = (
            *(epoch for epoch in begun if epoch in stamps),
            *(epoch for epoch in begun if any(sample_of_stamp(stamp, rate_hz, epoch) is not None for stamp in stamps)),
            *announced,
        )
        return next(iter(numbered), START_STAMP_NS)

    def samples(self, topic: Topic, rate_hz: int) -> IntArray:
        """Return the number of the sample that each stamp names, int64[n]; -1 off the grid and before the epoch."""
        epoch = self.epoch_ns(rate_hz)
        numbers = (sample_of_stamp(stamp, rate_hz, epoch) for stamp in self.stamps(topic).tolist())
        return np.array([-1 if number is None else number for number in numbers], dtype=np.int64)

    def joint_names(self, topic: Topic) -> tuple[str, ...]:
        """Return the joint names of a JointState topic, in the order of the columns of its fields; () if empty."""
        if topic.type != _JOINT_STATE:
            raise self._error(topic, "its messages have no joint names")
        names = dict.fromkeys(tuple(message.name) for message in self._messages(topic))
        if len({tuple(sorted(name)) for name in names}) > 1:
            raise self._error(topic, f"names change within the recording: {', '.join(map(str, names))}")
        return next(iter(names), ())

    def field(self, topic: Topic, name: str) -> FloatArray:
        """Return one field of all messages as float64.

        JointState: position, velocity, effort as [n, quantities] (quantities 0 where messages leave the field empty).
        Imu: angular_velocity and linear_acceleration as [n, 3], orientation (x, y, z, w) as [n, 4].
        Float64: data as [n]. Without messages n is 0, and so is the number of quantities of a JointState.
        """
        messages = self._messages(topic)
        values: list[Any] = [getattr(message, name, None) for message in messages]
        if topic.type == _JOINT_STATE and name in SEQUENCES:
            names = self.joint_names(topic)
            values = [_in_order(message, name, names) for message in messages]
            width = max(map(len, values), default=0)
            if content_of(topic) is not None:
                # a field may be filled in some messages only
                values = [value if len(value) else [math.nan] * width for value in values]
            try:
                return np.array(values, dtype=np.float64).reshape(len(values), len(values[0]) if values else 0)
            except ValueError:
                raise self._error(topic, f"{name} has not the same number of values in every message") from None
        if topic.type == _IMU and name in _VECTORS:
            components = _VECTORS[name]
            rows = [[getattr(value, component) for component in components] for value in values]
            return np.array(rows, dtype=np.float64).reshape(len(rows), len(components))
        if topic.type == _FLOAT64 and name == "data":
            return np.array(values, dtype=np.float64)
        raise self._error(topic, f"its messages have no numbers called {name}")

    def values(self, topic: Topic, name: str, names: Sequence[str]) -> FloatArray:
        """Return [n, names]: one field of a JointState topic, each value by the name that stands beside it.

        Raises:
            BagError: a name or the field is not there.
        """
        recorded, values = self.joint_names(topic), self.field(topic, name)
        if missing := [name for name in names if name not in recorded]:
            raise self._error(topic, f"has no {', '.join(missing)}, only {', '.join(recorded) or 'no names'}")
        if not values.shape[1] and len(values):
            raise self._error(topic, f"holds no {name} of its joints")
        if values.shape[1] != len(recorded):
            raise self._error(topic, f"holds {values.shape[1]} values of {name} for {len(recorded)} names")
        return values[:, [recorded.index(name) for name in names]]

    def texts(self, topic: Topic) -> list[str]:
        """Return the texts of a String topic."""
        if topic.type != _STRING:
            raise self._error(topic, "its messages are not texts")
        return [message.data for message in self._messages(topic)]

    def read_texts(self, topic: Topic, read: Callable[[str], T], needed: bool = True) -> list[T]:
        """Return what a reader finds in the texts of a topic; those that it refuses are left out.

        Where it refuses all of them that is an error, unless the graph itself may have published none.
        """
        values, refused = [], None
        try:
            texts = self.texts(topic)
        except BagError:
            if needed:
                raise
            return []
        for text in texts:
            try:
                values.append(read(text))
            except MessageError as error:
                refused = error
        if refused is not None and not values and needed:
            raise self._error(topic, str(refused)) from refused
        return values

    def _raw(self, topic: Topic) -> RawTopic:
        raw = self._topics.get(absolute_name(topic, self._namespace))
        if raw is None:
            raise self._error(topic, "not in the bag")
        if raw.type != topic.type:
            raise self._error(topic, f"recorded as {raw.type} instead of {topic.type}")
        return raw

    def _message(self, topic: Topic, row: int) -> bytes:
        """Return a message as it was recorded."""
        return self._raw(topic).messages[self._decode(topic).places[row]]

    def messages(self, topic: Topic) -> list[Any]:
        """Return the decoded messages of a topic."""
        return self._messages(topic)

    def _messages(self, topic: Topic) -> list[Any]:
        return self._decode(topic).messages

    def _decode(self, topic: Topic) -> Decoded:
        raw = self._raw(topic)
        if topic.name not in self._decoded:
            self._decoded[topic.name] = self._belonging(topic, raw)
        return self._decoded[topic.name]

    def _belonging(self, topic: Topic, raw: RawTopic) -> Decoded:
        """Return the messages that belong to a topic, or all that can be decoded where none does."""
        decoded: list[tuple[int, Any]] = []
        problem: Exception | None = None
        for place, data in enumerate(raw.messages):
            try:
                decoded.append((place, TYPESTORE.deserialize_cdr(data, raw.type)))
            except Exception as error:  # the decoder raises many kinds of exception on corrupt bytes
                problem = error
        if problem is not None and not decoded:
            what = f"a message cannot be decoded ({type(problem).__name__}: {problem})"
            raise self._error(topic, what) from problem
        content = content_of(topic) if raw.type == _JOINT_STATE else None
        if content is not None:
            decoded = [(place, _restricted(message, content.names)) for place, message in decoded]
        fitting = decoded if content is None else [each for each in decoded if belongs(each[1], content)]
        kept = fitting or decoded
        # of another robot, which may publish its joints there
        own = set(topic.of_joints)
        others = sum(own.isdisjoint(message.name) for _, message in decoded) if fitting and own else 0
        strays = len(raw.messages) - len(kept) - others
        return Decoded([message for _, message in kept], [place for place, _ in kept], strays)

    def _error(self, topic: Topic, what: str) -> BagError:
        return BagError(self.path, " ".join(f"{absolute_name(topic, self._namespace)}: {what}".split()))


def _restricted(message: Any, names: tuple[str, ...]) -> Any:
    """Return a JointState without the joints of others, such as a gripper's; as it is where some of `names` lack."""
    known = list(message.name)
    if len(known) == len(names) or not has_names(message, names):
        return message
    places = [known.index(name) for name in names]
    fields = {
        field: values[places] if len(values := getattr(message, field)) == len(known) else values for field in SEQUENCES
    }
    return dataclasses.replace(message, name=list(names), **fields)


def has_names(message: Any, names: Sequence[str]) -> bool:
    """Return whether a JointState is of these quantities, and maybe of others."""
    return set(names) <= set(message.name)


def _in_order(message: Any, field: str, names: tuple[str, ...]) -> Sequence[float]:
    """Return a field of a JointState in the order of some names; as it is where it has another length."""
    values: Sequence[float] = getattr(message, field)
    known = tuple(message.name)
    if known == names or len(values) != len(names):
        return values
    return [values[known.index(name)] for name in names]
