"""Samples in place of JointStates: the same content, the same reading, the same refusals."""

from __future__ import annotations

import math

import pytest
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState

from fivebar_description.interface import ACTIVE_JOINTS, JOINTS, REFERENCE_NAMES, SUPERVISOR_NAMES
from fivebar_description.joint_sample import MessageError, joint_sample
from fivebar_description.ros.messages import joint_state, read_fields, sampled, stamp_of

STAMP = 1_234_567_890_123_456_789

Fields = tuple[tuple[float, ...], tuple[float, ...], tuple[float, ...]]


@pytest.mark.parametrize("names", [JOINTS, ACTIVE_JOINTS, REFERENCE_NAMES, SUPERVISOR_NAMES, ()])
@pytest.mark.parametrize("filled", [(True, True, True), (True, False, False), (False, False, True), (False,) * 3])
def test_the_bytes_hold_the_message(names: tuple[str, ...], filled: tuple[bool, bool, bool]) -> None:
    first, second, third = (tuple(0.1 + one for one in range(len(names) if full else 0)) for full in filled)
    bytes_ = joint_sample(STAMP, names, first, second, third).cdr()
    message = joint_state(STAMP, names, first, second, third)
    # bytes between and after the fields are whatever was in memory
    assert deserialize_message(bytes_, JointState) == deserialize_message(serialize_message(message), JointState)
    received = sampled(deserialize_message(bytes_, JointState))
    assert (received.stamp_ns, received.name) == (stamp_of(message), names)
    assert (received.position, received.velocity, received.effort) == (first, second, third)


def test_a_sample_is_read_as_a_message_is() -> None:
    values = (1.0, math.nan)
    sample = joint_sample(STAMP, ("q21", "q11"), (1.0, 2.0), effort=values)
    message = joint_state(STAMP, ("q21", "q11"), (1.0, 2.0), effort=values)
    for one in (sample, message):
        assert read_fields(one, ACTIVE_JOINTS, ("position",)) == ((2.0, 1.0),)
        assert repr(read_fields(one, ACTIVE_JOINTS, ("effort",), allow_nan=True)) == "((nan, 1.0),)"
        for fields in (("effort",), ("velocity",)):
            with pytest.raises(MessageError):
                read_fields(one, ACTIVE_JOINTS, fields)
        with pytest.raises(MessageError, match="expected"):
            read_fields(one, JOINTS, ("position",))
