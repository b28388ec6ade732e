# SPDX-License-Identifier: Apache-2.0
"""Subframes of the register protocol of moteus drives, read and put together anew and not by the vendor's library."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator, Mapping
from typing import NamedTuple

FORMATS = "<b", "<h", "<i", "<f"
"""Formats by resolution: three sizes of integers, and floats."""

INT32, FLOAT = 2, 3

READ, WRITE, SAY, POLL = range(4)
"""Requests of a subframe: registers, or text of the diagnostic protocol."""

LENGTHS = (*range(9), 12, 16, 20, 24, 32, 48, 64)
"""Numbers of bytes that a frame of CAN FD can have."""

POSITION, VELOCITY, ACCELERATION, TORQUE, SCALE, VOLTAGE, TEMPERATURE, TIME, CURRENT, POWER, WHOLE = range(11)
"""Kinds of values."""

UNITS = {
    POSITION: (0.01, 0.0001, 0.00001),
    VELOCITY: (0.1, 0.00025, 0.00001),
    ACCELERATION: (0.05, 0.001, 0.00001),
    TORQUE: (0.5, 0.01, 0.001),
    SCALE: (1.0 / 127.0, 1.0 / 32767.0, 1.0 / 2147483647.0),
    VOLTAGE: (0.5, 0.1, 0.001),
    TEMPERATURE: (1.0, 0.1, 0.001),
    TIME: (0.01, 0.001, 0.000001),
    CURRENT: (1.0, 0.1, 0.001),
    POWER: (10.0, 0.05, 0.0001),
    WHOLE: (1.0, 1.0, 1.0),
}
"""Value of 1 in an integer of each size, by the kind of value."""


class Subframe(NamedTuple):
    """One subframe: what it asks for, and the register with its resolution and raw value, or channel and text."""

    kind: int
    register: int
    resolution: int = 0
    raw: float = 0.0
    text: bytes = b""


def subframes(data: bytes) -> Iterator[Subframe]:
    """Return the subframes of a frame, up to one that is not understood."""
    place = 0
    try:
        while place < len(data):
            word, place = data[place], place + 1
            if word in (0x40, 0x42):
                channel, place = _number(data, place)
                size, place = _number(data, place)
                if word == 0x40:
                    yield Subframe(SAY, channel, text=data[place : place + size])
                    place += size
                else:
                    yield Subframe(POLL, channel, resolution=size)
            elif word < 0x20:
                resolution, count = word >> 2 & 3, word & 3
                if not count:
                    count, place = _number(data, place)
                first, place = _number(data, place)
                for register in range(first, first + count):
                    if word >= 0x10:
                        yield Subframe(READ, register, resolution)
                    else:
                        (raw,) = struct.unpack_from(FORMATS[resolution], data, place)
                        place += struct.calcsize(FORMATS[resolution])
                        yield Subframe(WRITE, register, resolution, raw)
            elif word != 0x50:
                return
    except (IndexError, struct.error):
        return


def scaled(raw: float, resolution: int, kind: int) -> float:
    """Return the value of a raw one; the least integer is no number."""
    if resolution == FLOAT:
        return raw
    return math.nan if raw == -_largest(resolution) - 1 else raw * UNITS[kind][resolution]


def reply(register: int, value: float, resolution: int, kind: int) -> bytes:
    """Return the subframe that answers with the value of a register."""
    raw: float = value
    if resolution != FLOAT:
        largest = _largest(resolution)
        steps = value / UNITS[kind][resolution]
        raw = int(max(-largest, min(largest, steps))) if math.isfinite(value) else -largest - 1
    head = bytes((0x21 | resolution << 2, *_varuint(register)))
    return head + bytes(struct.pack(FORMATS[resolution], raw))


def read_error(register: int) -> bytes:
    """Return the subframe that says that there is no such register."""
    return bytes((0x31, *_varuint(register), 1))


def said(channel: int, text: bytes) -> bytes:
    """Return the subframe with text of the diagnostic protocol."""
    return bytes((0x41, channel, len(text))) + text


def filled(data: bytes) -> bytes:
    """Return data with the number of bytes that a frame has, filled up with what means nothing."""
    length: int = min(length for length in LENGTHS if length >= len(data))
    return data.ljust(length, b"\x50")


def kinds(table: Mapping[int, tuple[int, ...]]) -> dict[int, int]:
    """Return the kind of each register, of a table from kinds to registers."""
    return {register: kind for kind, registers in table.items() for register in registers}


def _largest(resolution: int) -> int:
    return (1 << (8 << resolution) - 1) - 1


def _number(data: bytes, place: int) -> tuple[int, int]:
    value = shift = 0
    while True:
        value |= (data[place] & 0x7F) << shift
        place, shift = place + 1, shift + 7
        if not data[place - 1] & 0x80:
            return value, place


def _varuint(value: int) -> Iterator[int]:
    while value > 0x7F:
        yield value & 0x7F | 0x80
        value >>= 7
    yield value
