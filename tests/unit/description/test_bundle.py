"""Bundles of messages: what is packed comes out again, in its order, and nothing else is taken for a bundle."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from std_msgs.msg import UInt8MultiArray

from fivebar_description.bundle import bundled, unbundled
from fivebar_description.joint_sample import MessageError

MESSAGES = st.lists(st.tuples(st.text(max_size=20).filter(lambda name: name.isprintable()), st.binary(max_size=40)))


@given(MESSAGES)
def test_what_is_packed_comes_out_again(messages: list[tuple[str, bytes]]) -> None:
    assert unbundled(bundled(messages)) == messages


def test_a_bundle_is_a_message_of_ros() -> None:
    """rclpy reads it as the array of bytes that it is, and writes the same."""
    data = bundled([("/torque_command", b"\0\1\0\0abc"), ("/robot1/reference", b"")])
    message = deserialize_message(data, UInt8MultiArray)
    assert bytes(message.data[6:21]) == b"/torque_command"
    assert unbundled(bytes(serialize_message(message)))[1] == ("/robot1/reference", b"")


@given(MESSAGES.filter(bool), st.data())
def test_a_part_of_a_bundle_is_none(messages: list[tuple[str, bytes]], data: st.DataObject) -> None:
    whole = bundled(messages)
    with pytest.raises(MessageError):
        unbundled(whole[: data.draw(st.integers(0, len(whole) - 1))])


@pytest.mark.parametrize(
    ("damaged", "reason"),
    [
        (b"", "no bundle"),
        (b"\0\0" + bundled([])[2:], "no bundle"),
        (bundled([("/a", b"b")])[:-4] + b"\xff\xff\xff\xff", "name is no text|ends within"),
        (bundled([("/a", b"b")])[:12] + b"\x03\0\0\0abc", "ends within a message"),
        (bundled([("/a", b"")])[:-2] + b"\xff\xfe", "name is no text"),
    ],
)
def test_what_is_wrong_is_said(damaged: bytes, reason: str) -> None:
    with pytest.raises(MessageError, match=reason):
        unbundled(damaged)
