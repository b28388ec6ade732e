# SPDX-License-Identifier: Apache-2.0
"""Samples in place of JointStates: the same content, the same reading, the same refusals."""

from __future__ import annotations

import math
from operator import attrgetter

import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from fivebar_description.interface import ACTIVE_JOINTS, JOINTS, REFERENCE_NAMES, SUPERVISOR_NAMES
from fivebar_description.joint_sample import JointSample, MessageError
from fivebar_description.ros.messages import SampleReader, joint_state, own_fields, sampled, stamp_of

STAMP = 1_234_567_890_123_456_789

Fields = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]


@pytest.mark.parametrize("names", [JOINTS, ACTIVE_JOINTS, REFERENCE_NAMES, SUPERVISOR_NAMES, ()])
@pytest.mark.parametrize("filled", [(True, True, True), (True, False, False), (False, False, True), (False,) * 3])
def test_the_bytes_hold_the_message(names: tuple[str, ...], filled: tuple[bool, bool, bool]) -> None:
    first, second, third = (tuple(0.1 + one for one in range(len(names) if full else 0)) for full in filled)
    bytes_ = JointSample(STAMP, names, first, second, third).cdr()
    message = joint_state(STAMP, names, first, second, third)
    # bytes between and after the fields are whatever was in memory
    assert deserialize_message(bytes_, JointState) == deserialize_message(serialize_message(message), JointState)
    received = sampled(deserialize_message(bytes_, JointState))
    assert (received.stamp_ns, received.name) == (stamp_of(message), names)
    assert (received.position, received.velocity, received.effort) == (first, second, third)


def same(one: JointSample, other: JointSample) -> bool:
    fields = attrgetter("stamp_ns", "name", "position", "velocity", "effort")
    return repr(fields(one)) == repr(fields(other))


LAYOUTS = [
    JointSample(STAMP, JOINTS, (1.0, 2.0, 3.0, 4.0), (5.0, 6.0, 7.0, 8.0), (0.0, math.nan, -0.0, math.inf)),
    JointSample(STAMP + 1, JOINTS, (1.0, 2.0, 3.0, 4.0), effort=(5.0, 6.0, 7.0, 8.0)),
    JointSample(STAMP + 2, JOINTS, (1.0, 2.0, 3.0, 4.0), (5.0, 6.0, 7.0, 8.0)),
    JointSample(STAMP + 3, JOINTS[::-1], (1.0, 2.0, 3.0, 4.0), (5.0, 6.0, 7.0, 8.0)),
    JointSample(STAMP + 4, ACTIVE_JOINTS, effort=(1.0, 2.0)),
    JointSample(STAMP + 5, ("a", "b"), (1.0, 2.0), (3.0,)),
    JointSample(STAMP + 6, ()),
]


@pytest.mark.parametrize("last", LAYOUTS)
@pytest.mark.parametrize("sample", LAYOUTS)
def test_a_message_is_read_alike_whatever_came_before(last: JointSample, sample: JointSample) -> None:
    """Also as another program serialises it, and where its fields are of other lengths than the last one's."""
    message = deserialize_message(sample.cdr(), JointState)
    for data in (sample.cdr(), serialize_message(message), sample.cdr() + bytes(4)):
        read = SampleReader()
        assert same(read(last.cdr()), last)
        assert same(read(data), sample)
    # without a message in between, where it is alike
    found = last.alike(sample.cdr())
    assert (found is not None) == (last is sample)
    assert found is None or same(found, sample)


def test_a_message_of_another_frame_is_read_too() -> None:
    message = joint_state(STAMP, JOINTS, (1.0, 2.0, 3.0, 4.0))
    message.header.frame_id = "elsewhere"
    read = SampleReader()
    for _ in range(2):
        assert same(read(serialize_message(message)), JointSample(STAMP, JOINTS, (1.0, 2.0, 3.0, 4.0)))


@pytest.mark.parametrize("data", [b"", b"\0\1\0\0", bytes(20), LAYOUTS[0].cdr()[:-8], b"\7" + LAYOUTS[0].cdr()[1:]])
def test_bytes_that_are_no_message_are_refused_and_the_next_message_is_read(data: bytes) -> None:
    read = SampleReader()
    for _ in range(2):
        with pytest.raises(MessageError, match="no JointState"):
            read(data)
        assert same(read(LAYOUTS[0].cdr()), LAYOUTS[0])


def test_other_names_in_a_message_are_left_out_where_that_is_asked_for() -> None:
    names = ("finger", *reversed(ACTIVE_JOINTS))
    message = joint_state(STAMP, names, (9.0, 2.0, 1.0), (), (9.0, 4.0, 3.0))
    assert own_fields(message, ACTIVE_JOINTS, ("position", "effort")) == ((1.0, 2.0), (3.0, 4.0))
    with pytest.raises(MessageError):
        sampled(message).read(ACTIVE_JOINTS, ("position",))
    with pytest.raises(MessageError):
        own_fields(joint_state(STAMP, names[:2], (9.0, 2.0)), ACTIVE_JOINTS, ("position",))


def test_a_sample_is_read_as_a_message_is() -> None:
    values = (1.0, math.nan)
    sample = JointSample(STAMP, ("q21", "q11"), (1.0, 2.0), effort=values)
    message = joint_state(STAMP, ("q21", "q11"), (1.0, 2.0), effort=values)
    for one in (sample, sampled(message)):
        # also once it has been read
        for _ in range(2):
            assert one.read(ACTIVE_JOINTS, ("position",)) == ((2.0, 1.0),)
            assert repr(one.read(ACTIVE_JOINTS, ("effort",), allow_nan=True)) == "((nan, 1.0),)"
            for fields in (("effort",), ("velocity",)):
                with pytest.raises(MessageError):
                    one.read(ACTIVE_JOINTS, fields)
            with pytest.raises(MessageError, match="expected"):
                one.read(JOINTS, ("position",))
