# SPDX-License-Identifier: Apache-2.0
"""The content of a JointState without ROS: made, checked, read and serialised."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterable, Sequence
from functools import lru_cache

from fivebar_description.interface import BASE_FRAME, LATEST_STAMP_NS, NANOSECONDS

LARGEST = 1e100
"""Largest magnitude that is accepted: sums and squares of larger values would overflow."""


LAYOUTS = 256
"""Layouts of messages that are remembered: more than a graph has."""


class MessageError(ValueError):
    """A message that must not be used; the text gives the reason."""


Fields = tuple[tuple[float, ...], ...]
"""Values of some quantities, field by field."""


class JointSample:
    """The content of a JointState, in place of one: cheap to make, to read several times, and to serialise.

    Attributes:
        stamp_ns: stamp (ns).
        name: of the quantities.
        position, velocity, effort: a value for each of them, or empty.
        frame: its frame.
        known: what has been read of it (`fields_of`).
    """

    __slots__ = ("effort", "frame", "known", "name", "position", "stamp_ns", "velocity")

    def __init__(
        self,
        stamp_ns: int,
        name: Sequence[str],
        position: Iterable[float] = (),
        velocity: Iterable[float] = (),
        effort: Iterable[float] = (),
        frame: str = BASE_FRAME,
    ) -> None:
        self.stamp_ns = stamp_ns
        self.name = tuple(name)
        self.position = tuple(position)
        self.velocity = tuple(velocity)
        self.effort = tuple(effort)
        self.frame = frame
        self.known: dict[FieldReader, Fields] = {}

    def read(self, names: tuple[str, ...], fields: Sequence[str], allow_nan: bool = False) -> Fields:
        """Return the wanted fields ("position", "velocity", "effort") in the order of `names`, checked.

        The joints may come in any order. With `allow_nan` a NaN (an undefined torque) passes; infinities never do.

        Raises:
            MessageError: wrong names, a field of another length than the names, or a value that is not finite or beyond
                `LARGEST`.
        """
        own_names = self.name
        if own_names != names and (len(own_names) != len(names) or sorted(own_names) != sorted(names)):
            raise MessageError(f"{len(own_names)} names {list(own_names[: len(names)])}, expected {list(names)}")
        columns = []
        for field in fields:
            values: tuple[float, ...] = getattr(self, field)
            if len(values) != len(names):
                raise MessageError(f"{field} has {len(values)} values, expected {len(names)}")
            if own_names != names:
                values = tuple(values[own_names.index(name)] for name in names)
            for name, value in zip(names, values, strict=True):
                if not -LARGEST <= value <= LARGEST and not (allow_nan and math.isnan(value)):
                    raise MessageError(f"{field} of {name} is {value}, expected a finite number of at most {LARGEST:g}")
            columns.append(values)
        return tuple(columns)

    def cdr(self, frame: str | None = None) -> bytes:
        """Return the JointState in CDR, as a publisher serialises it; in another frame than its own if one is given."""
        position, velocity, effort = self.position, self.velocity, self.effort
        frame = self.frame if frame is None else frame
        layout = _layout(frame, self.name, len(position), len(velocity), len(effort))
        seconds, nanoseconds = divmod(self.stamp_ns, NANOSECONDS)
        head = _HEAD, seconds, nanoseconds, _names(frame, self.name)
        return layout.pack(*head, len(position), *position, len(velocity), *velocity, len(effort), *effort)

    def alike(self, data: bytes) -> JointSample | None:
        """Return the sample in a JointState in CDR that differs from this one in its stamp and values only.

        None where it may differ in anything else; which values are filled belongs to that.
        """
        counts = len(self.position), len(self.velocity), len(self.effort)
        layout = _layout(self.frame, self.name, *counts)
        if len(data) < layout.size:
            return None
        head, seconds, nanoseconds, names, *fields = layout.unpack_from(data)
        velocity, effort = counts[0] + 1, counts[0] + counts[1] + 2
        if (head, names) != (_HEAD, _names(self.frame, self.name)):
            return None
        if (fields[0], fields[velocity], fields[effort]) != counts:
            return None
        if not 0 <= seconds * NANOSECONDS + nanoseconds <= LATEST_STAMP_NS:
            return None
        return JointSample(
            seconds * NANOSECONDS + nanoseconds,
            self.name,
            tuple(fields[1:velocity]),
            tuple(fields[velocity + 1 : effort]),
            tuple(fields[effort + 1 :]),
            self.frame,
        )


class FieldReader:
    """Reads fields of a sample, see `JointSample.read`: what is good is checked once for all readers of a process."""

    __slots__ = ("_wanted",)

    def __init__(self, names: tuple[str, ...], fields: tuple[str, ...], allow_nan: bool) -> None:
        self._wanted = names, fields, allow_nan

    def __call__(self, message: JointSample) -> Fields:
        """Return the fields.

        Raises:
            MessageError: as `JointSample.read`.
        """
        known = message.known.get(self)
        if known is None:
            known = message.known[self] = message.read(*self._wanted)
        return known


@lru_cache(LAYOUTS)
def fields_of(names: tuple[str, ...], *fields: str, allow_nan: bool = False) -> FieldReader:
    """Return the reader of a sample's fields, in the order of `names`."""
    return FieldReader(names, fields, allow_nan)


_HEAD = b"\0\1\0\0"
"""Says that CDR in the order of this machine follows, from which on fields are aligned."""


class OneAnswer:
    """Tells whether a sample gets a second torque that differs from the first: zero torque may always follow."""

    def __init__(self) -> None:
        """Begin without an answer."""
        self._stamp_ns = -1
        self._torque: tuple[float, ...] = ()

    def contradicts(self, stamp_ns: int, torque: tuple[float, ...]) -> bool:
        """Return whether a torque is not that of the last answer, to a sample of the same stamp, and not zero."""
        if stamp_ns != self._stamp_ns:
            if stamp_ns > self._stamp_ns:
                self._stamp_ns, self._torque = stamp_ns, torque
            return False
        if torque == self._torque or not any(torque):
            self._torque = torque
            return False
        return True


@lru_cache(LAYOUTS)
def _names(frame: str, names: tuple[str, ...]) -> bytes:
    """Return the frame and the sequence of names, aligned for the number that follows."""
    return _word(frame) + struct.pack("<I", len(names)) + b"".join(map(_word, names))


def _word(text: str) -> bytes:
    word = text.encode() + b"\0"
    return struct.pack("<I", len(word)) + word + b"\0" * (-len(word) % 4)


@lru_cache(LAYOUTS)
def _layout(frame: str, names: tuple[str, ...], *lengths: int) -> struct.Struct:
    """Return the layout of a JointState in CDR with fields of these lengths; doubles are aligned to 8 bytes."""
    place = 8 + len(_names(frame, names))
    layout = f"<4siI{len(_names(frame, names))}s"
    for length in lengths:
        place += 4
        padding = -place % 8 if length else 0
        layout += f"I{padding}x{length}d"
        place += padding + 8 * length
    return struct.Struct(layout)


def part_of(message: JointSample, names: tuple[str, ...]) -> JointSample | None:
    """Return the part of a sample about some names, None where it is about none of them.

    A message that lacks some of them, or with fields of other lengths, is returned as it is, for its reader to refuse.
    """
    own_names = message.name
    if not any(name in names for name in own_names):
        return None
    fields = message.position, message.velocity, message.effort
    if not set(names) <= set(own_names) or any(len(field) not in (0, len(own_names)) for field in fields):
        return message
    places = [own_names.index(name) for name in names]
    position, velocity, effort = (tuple(field[place] for place in places) if field else () for field in fields)
    return JointSample(message.stamp_ns, names, position, velocity, effort, message.frame)
