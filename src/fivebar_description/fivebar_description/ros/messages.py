# SPDX-License-Identifier: Apache-2.0
"""Packing and checking of the graph's messages; every node reads and writes them through these functions.

Texts are published with standard messages that say the same, for tools that show and plot such messages.
"""

from __future__ import annotations

import importlib
import json
import secrets
from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

from builtin_interfaces.msg import Time
from diagnostic_msgs.msg import DiagnosticStatus, KeyValue
from rclpy.node import Node
from rclpy.publisher import Publisher
from rclpy.qos import DurabilityPolicy, HistoryPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Header, String

from fivebar_description.imu import Vector3
from fivebar_description.interface import (
    ALL_WELL,
    BASE_FRAME,
    DRIVES_STATE,
    HARDWARE,
    LATEST_STAMP_NS,
    NANOSECONDS,
    RUN_EPOCH,
    SAFETY_STATE,
    Qos,
    Topic,
    frame_prefix,
)
from fivebar_description.joint_sample import JointSample, MessageError, part_of
from fivebar_description.run_plan import read_epoch

LEVELS = {"failed": DiagnosticStatus.ERROR, "refused": DiagnosticStatus.WARN, "stopped": DiagnosticStatus.WARN}
"""Levels of the states of a run, a request or a program; all others are well."""

MOST_LISTED = 25
"""Elements of an array that a twin has: more of them would keep a control cycle waiting."""


def message_class(topic: Topic) -> Any:
    """Return the rclpy class of a topic's message type, such as sensor_msgs.msg.JointState."""
    package, folder, name = topic.type.split("/")
    return getattr(importlib.import_module(f"{package}.{folder}"), name)


def stamp_of(message: Any) -> int:
    """Return a stamped message's stamp in integer nanoseconds."""
    if isinstance(message, JointSample):
        return message.stamp_ns
    stamp = message.header.stamp
    return int(stamp.sec) * NANOSECONDS + int(stamp.nanosec)


def checked_stamp(message: Any) -> int:
    """Return a message's stamp in integer nanoseconds.

    Raises:
        MessageError: it is no time that a node could have taken.
    """
    stamp_ns = stamp_of(message)
    if not 0 <= stamp_ns <= LATEST_STAMP_NS:
        raise MessageError(f"stamp {stamp_ns} ns, expected 0 to {LATEST_STAMP_NS} ns")
    return stamp_ns


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


def imu_message(stamp_ns: int, frame: str, angular_velocity: Vector3, acceleration: Vector3 | None = None) -> Imu:
    """Return an IMU's reading in its own frame (rad/s, m/s^2), without orientation."""
    message = Imu()
    message.header.stamp = to_stamp(stamp_ns)
    message.header.frame_id = frame
    # -1 means that there is no such measurement (sensor_msgs/Imu)
    message.orientation_covariance[0] = -1.0
    vector = message.angular_velocity
    vector.x, vector.y, vector.z = angular_velocity
    if acceleration is None:
        message.linear_acceleration_covariance[0] = -1.0
    else:
        vector = message.linear_acceleration
        vector.x, vector.y, vector.z = acceleration
    return message


def new_request_id() -> str:
    """Return an id for a request, by which its statuses are told from those of others."""
    return secrets.token_hex(8)


def goal_message(fields: Mapping[str, float], request_id: str) -> JointState:
    """Return a request for a motion with fields by name; `goal/status` names the id with each of its statuses."""
    message = JointState(name=list(fields), position=list(fields.values()))
    message.header.frame_id = request_id
    return message


def sampled(message: JointState) -> JointSample:
    """Return a received JointState as a sample, which is cheaper to read for several readers.

    Raises:
        MessageError: its stamp is impossible.
    """
    return JointSample(
        checked_stamp(message),
        tuple(message.name),
        tuple(message.position),
        tuple(message.velocity),
        tuple(message.effort),
        message.header.frame_id,
    )


def received_joint_state(data: bytes) -> JointState:
    """Return the JointState in bytes that were received.

    Raises:
        MessageError: there is none.
    """
    try:
        message: JointState = deserialize_message(data, JointState)
    except (RuntimeError, UnicodeError) as error:
        raise MessageError(f"{len(data)} bytes that are no JointState") from error
    return message


class SampleReader:
    """Reads the serialised JointStates of a topic, whose messages are alike, for the most part without making one."""

    def __init__(self) -> None:
        """Begin with a message of any layout."""
        self._last: JointSample | None = None

    def __call__(self, data: bytes) -> JointSample:
        """Return the sample in a message.

        Raises:
            MessageError: it is no JointState.
        """
        sample = None if self._last is None else self._last.alike(data)
        if sample is None:
            sample = sampled(received_joint_state(data))
        self._last = sample
        return sample


class Serializing:
    """Publishes samples in the place of a JointState as bytes, without making a message first, in the robot's frame."""

    def __init__(self, publisher: Publisher[Any], frame: str) -> None:
        self._publisher = publisher
        self._frame = frame

    def publish(self, message: JointState | JointSample, /) -> None:
        """Publish a message."""
        self._publisher.publish(message.cdr(self._frame) if isinstance(message, JointSample) else message)


def own_fields(
    message: JointState, names: tuple[str, ...], fields: Sequence[str], allow_nan: bool = False
) -> tuple[tuple[float, ...], ...]:
    """Return fields of a JointState that may have other names besides, such as those of a gripper.

    Raises:
        MessageError: as `JointSample.read` does, or the stamp is impossible.
    """
    sample = sampled(message)
    return (part_of(sample, names) or sample).read(names, fields, allow_nan)


def qos_profile(qos: Qos, depth: int | None = None) -> QoSProfile:
    """Return the rclpy profile; `depth` overrides the history depth, which each side chooses."""
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth if depth is not None else qos.depth,
        reliability=ReliabilityPolicy.RELIABLE,
        durability=DurabilityPolicy.TRANSIENT_LOCAL if qos.transient_local else DurabilityPolicy.VOLATILE,
    )


def best_effort(depth: int) -> QoSProfile:
    """Return the profile of who only looks on: the publishers of a topic neither wait for it nor keep anything for it.

    What is lost is not asked for again, and the newest `depth` messages are kept.
    """
    return QoSProfile(
        history=HistoryPolicy.KEEP_LAST,
        depth=depth,
        reliability=ReliabilityPolicy.BEST_EFFORT,
        durability=DurabilityPolicy.VOLATILE,
    )


class Twinned:
    """Publishes a text of a node and, made of it, the standard message that says the same."""

    def __init__(self, node: Node, topic: Topic, text: Publisher[Any], twin: Publisher[Any]) -> None:
        self._topic, self._text, self._twin = topic, text, twin
        self._name = node.resolve_topic_name(topic.name)
        self._prefix = frame_prefix(node.get_namespace())

    def publish(self, message: String, /) -> None:
        """Publish a text and its twin."""
        self._text.publish(message)
        if self._topic == RUN_EPOCH:
            epoch = to_stamp(read_epoch(message.data) or 0)
            self._twin.publish(Header(stamp=epoch, frame_id=self._prefix + BASE_FRAME))
            return
        described = state_status if self._topic in (SAFETY_STATE, DRIVES_STATE) else content_status
        status = described(message.data)
        status.name, status.hardware_id = self._name, self._prefix + HARDWARE
        self._twin.publish(status)


def state_status(text: str) -> DiagnosticStatus:
    """Return the status that a text says: that all is well, or a fault."""
    level = DiagnosticStatus.OK if text == ALL_WELL else DiagnosticStatus.ERROR
    fault, _, detail = text.partition(": ")
    values = [KeyValue(key="state", value=fault), KeyValue(key="detail", value=detail)]
    return DiagnosticStatus(level=level, message=text, values=values)


def content_status(text: str) -> DiagnosticStatus:
    """Return the status in a text of JSON: its state, with the reason, and all its values."""
    content = json.loads(text)
    state, reason = str(content["state"]), content.get("reason", "")
    return DiagnosticStatus(
        level=LEVELS.get(state, DiagnosticStatus.OK),
        message=f"{state}: {reason}" if reason else state,
        values=[KeyValue(key=key, value=value) for key, value in _flat(content, "")],
    )


def _flat(content: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, str]]:
    """Yield values by their names with dots; of an array its elements, by their numbers, of a long one its length."""
    for key, value in content.items():
        if isinstance(value, list) and len(value) > MOST_LISTED:
            yield f"{prefix}{key}.length", str(len(value))
            continue
        if isinstance(value, list):
            value = {str(number): element for number, element in enumerate(value)}
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", "" if value is None else str(value)
