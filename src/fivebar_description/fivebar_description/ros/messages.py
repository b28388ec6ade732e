"""Packing and checking of the graph's messages; every node reads and writes them through these functions."""

from __future__ import annotations

import importlib
import math
from array import array
from collections.abc import Iterable, Sequence
from typing import Any

from builtin_interfaces.msg import Time
from sensor_msgs.msg import JointState

from fivebar_description.interface import BASE_FRAME, NANOSECONDS, Topic

LARGEST = 1e100
"""Largest magnitude that is accepted: sums and squares of larger values would overflow."""


class MessageError(ValueError):
    """A message that must not be used; the text gives the reason."""


def message_class(topic: Topic) -> Any:
    """Return the rclpy class of a topic's message type, such as sensor_msgs.msg.JointState."""
    package, folder, name = topic.type.split("/")
    return getattr(importlib.import_module(f"{package}.{folder}"), name)


def stamp_of(message: Any) -> int:
    """Return a stamped message's stamp in integer nanoseconds."""
    stamp = message.header.stamp
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def to_stamp(stamp_ns: int) -> Time:
    """Return integer nanoseconds as a ROS stamp."""
    seconds, nanoseconds = divmod(stamp_ns, NANOSECONDS)
    return Time(sec=seconds, nanosec=nanoseconds)


def joint_state(
    stamp_ns: int,
    names: Sequence[str],
    position: Iterable[float] = (),
    velocity: Iterable[float] = (),
    effort: Iterable[float] = (),
) -> JointState:
    """Return a JointState of named quantities; a field that is left out stays empty."""
    message = JointState()
    message.header.stamp = to_stamp(stamp_ns)
    message.header.frame_id = BASE_FRAME
    message.name = list(names)
    message.position = array("d", position)
    message.velocity = array("d", velocity)
    message.effort = array("d", effort)
    return message


def read_fields(
    message: JointState, names: tuple[str, ...], fields: Sequence[str], allow_nan: bool = False
) -> tuple[tuple[float, ...], ...]:
    """Return the wanted fields ("position", "velocity", "effort") of a JointState, in the order of `names`.

    The joints may come in any order. With `allow_nan` a NaN (an undefined torque) passes; infinities never do.

    Raises:
        MessageError: wrong names, a field of another length than the names, or a value that is not finite or beyond
            `LARGEST`.
    """
    given = tuple(message.name)
    if given != names and sorted(given) != sorted(names):
        raise MessageError(f"names {list(given)}, expected {list(names)}")
    return tuple(_field(message, field, given, names, allow_nan) for field in fields)


def _field(
    message: JointState, field: str, given: tuple[str, ...], names: tuple[str, ...], allow_nan: bool
) -> tuple[float, ...]:
    values = tuple(getattr(message, field))
    if len(values) != len(names):
        raise MessageError(f"{field} has {len(values)} values, expected {len(names)}")
    if given != names:
        values = tuple(values[given.index(name)] for name in names)
    for name, value in zip(names, values, strict=True):
        if not abs(value) <= LARGEST and not (allow_nan and math.isnan(value)):
            raise MessageError(f"{field} of {name} is {value}, expected a finite number of at most {LARGEST:g}")
    return values
