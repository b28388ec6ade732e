# SPDX-License-Identifier: Apache-2.0
"""Frames: what the known ones say, and that no other frame says anything or raises."""

from __future__ import annotations

import struct

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.hardware.configuration import load_drives
from fivebar_control.hardware.fault import emergency_name
from fivebar_control.hardware.frames import (
    Effort,
    Emergency,
    FrameReader,
    Heartbeat,
    Malformed,
    MastersOwn,
    SdoAnswer,
    Status,
    command_data,
)

FIRST, SECOND = load_drives("dextar_emulated").pair
READER = FrameReader((FIRST, SECOND.model_copy(update={"velocity_in_pdo": False})), 127)

LENGTHS = {
    **{base + node: 6 for base in (0x180,) for node in (1, 2)},
    0x281: 6,
    0x282: 2,
    **{0x700 + node: 1 for node in (1, 2)},
    **{0x080 + node: 8 for node in (1, 2)},
    **{0x580 + node: 8 for node in (1, 2)},
}
"""Every id that is known, and the length of its data."""

OWN = (0x000, 0x080, 0x201, 0x202, 0x601, 0x602, 0x77F)
"""Every id that the master sends."""


def test_known_frames() -> None:
    assert READER.read(0x181, bytes.fromhex("371200ffffff")) == Status(0, 0x1237, -256)
    assert READER.read(0x182, bytes.fromhex("400201000000")) == Status(1, 0x0240, 1)
    assert READER.read(0x281, bytes.fromhex("18fc10270000")) == Effort(0, -1000, 10000)
    assert READER.read(0x282, bytes.fromhex("e803")) == Effort(1, 1000, None)
    assert READER.read(0x701, b"\x05") == Heartbeat(0, 5)
    assert READER.read(0x702, b"\x7f") == Heartbeat(1, 127)
    assert READER.read(0x081, bytes.fromhex("3081110102030405")) == Emergency(0, 0x8130, 0x11, b"\1\2\3\4\5")
    assert READER.read(0x582, bytes(8)) == SdoAnswer(1)


@pytest.mark.parametrize(
    ("can_id", "data", "known"),
    [
        (0x183, bytes(6), False),
        (0x77E, b"\x05", False),
        (0x181, bytes(5), True),
        (0x181, bytes(8), True),
        (0x281, bytes(2), True),
        (0x282, bytes(6), True),
        (0x701, b"", True),
        (0x701, b"\x06", True),
        (0x081, bytes(7), True),
        (0x581, bytes(4), True),
    ],
)
def test_malformed_frames(can_id: int, data: bytes, known: bool) -> None:
    assert READER.read(can_id, data) == Malformed(known)


@given(can_id=st.integers(0, 0x1FFFFFFF) | st.sampled_from([*LENGTHS, *OWN]), data=st.binary(max_size=64))
def test_any_frame_is_read_or_malformed(can_id: int, data: bytes) -> None:
    frame = READER.read(can_id, data)
    if can_id in OWN:
        assert frame == MastersOwn()
    elif LENGTHS.get(can_id) != len(data):
        assert frame == Malformed(known=can_id in LENGTHS)
    elif can_id >> 7 == 0x700 >> 7:
        assert isinstance(frame, Heartbeat) == (data[0] in (0, 4, 5, 127))
    else:
        assert not isinstance(frame, Malformed)


@given(word=st.integers(0, 0xFFFF), torque=st.integers(-0x8000, 0x7FFF))
def test_commands_hold_controlword_and_torque(word: int, torque: int) -> None:
    data = command_data(word, torque)
    assert struct.unpack("<Hh", data) == (word, torque)


@pytest.mark.parametrize(
    ("code", "name"),
    [
        (0x3210, "over-voltage of the DC link"),
        (0x3299, "internal voltage"),
        (0x3499, "voltage"),
        (0x2399, "output current"),
        (0x7305, "incremental encoder 1"),
        (0x7390, "sensor"),
        (0x8130, "heartbeat lost"),
        (0x8199, "communication"),
        (0xFF01, "manufacturer's own"),
        (0x0042, "unknown error"),
    ],
)
def test_emergency_codes_have_names(code: int, name: str) -> None:
    assert emergency_name(code) == name


@given(code=st.integers(0, 0xFFFF))
def test_any_emergency_code_has_words(code: int) -> None:
    assert emergency_name(code)
