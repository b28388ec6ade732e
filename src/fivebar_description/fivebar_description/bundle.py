"""Bundles of messages: what a process publishes in a cycle, as one message for whoever records it.

A message costs its writer more for each process that reads it than all that the node computes for it. A bundle is a
std_msgs/UInt8MultiArray with the messages one after the other: of each the length of its topic's name and its own, the
name, and the message as it was serialised.
"""

from __future__ import annotations

import struct
from collections.abc import Iterable

from fivebar_description.joint_sample import CDR_HEAD, MessageError

_ARRAY = struct.Struct("<4sIII")
"""Before the bytes of an array in CDR: the order of bytes, no dimensions, no offset, and how many bytes there are."""

_LENGTHS = struct.Struct("<HI")
"""Before a message of a bundle."""


def bundled(messages: Iterable[tuple[str, bytes]]) -> bytes:
    """Return serialised messages, each with the full name of its topic, as a UInt8MultiArray in CDR."""
    parts: list[bytes] = []
    for topic, message in messages:
        name = topic.encode()
        parts += _LENGTHS.pack(len(name), len(message)), name, message
    content = b"".join(parts)
    return _ARRAY.pack(CDR_HEAD, 0, 0, len(content)) + content


def unbundled(data: bytes) -> list[tuple[str, bytes]]:
    """Return the messages of a bundle in their order, each with the full name of its topic.

    Raises:
        MessageError: it is no bundle, or an incomplete one.
    """
    if len(data) < _ARRAY.size:
        raise MessageError(f"{len(data)} bytes that are no bundle of messages")
    head, dimensions, offset, length = _ARRAY.unpack_from(data)
    place, end = _ARRAY.size, _ARRAY.size + length
    if (head, dimensions, offset) != (CDR_HEAD, 0, 0) or end > len(data):
        raise MessageError(f"{len(data)} bytes that are no bundle of messages")
    messages: list[tuple[str, bytes]] = []
    while place < end:
        if place + _LENGTHS.size > end:
            raise MessageError("a bundle that ends within a message")
        name_length, message_length = _LENGTHS.unpack_from(data, place)
        name = place + _LENGTHS.size
        message = name + name_length
        place = message + message_length
        if place > end:
            raise MessageError("a bundle that ends within a message")
        try:
            messages.append((data[name:message].decode(), data[message:place]))
        except UnicodeDecodeError as error:
            raise MessageError("a bundle with a topic whose name is no text") from error
    return messages
