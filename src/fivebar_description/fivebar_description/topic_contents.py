# SPDX-License-Identifier: Apache-2.0
"""The contents of the JointStates of each topic, by which a message that is none of the graph's is recognised."""

from __future__ import annotations

from typing import Any, NamedTuple

from fivebar_description.interface import (
    ACTIVE_JOINTS,
    ESTIMATE_COVARIANCE,
    ESTIMATE_DISTURBANCE,
    ESTIMATE_NAMES,
    GROUND_TRUTH,
    JOINT_STATES,
    JOINTS,
    LATEST_STAMP_NS,
    MOTOR_STATES,
    NANOSECONDS,
    PLATFORM_NAMES,
    REFERENCE,
    REFERENCE_NAMES,
    SUPERVISOR_NAMES,
    SUPERVISOR_STATE,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    VISION_ERROR,
    VISION_NAMES,
    VISION_PLATFORM,
    Topic,
)

SEQUENCES = ("position", "velocity", "effort")
"""Fields of a JointState with a number for each name, or empty."""


class Content(NamedTuple):
    """The names in the JointStates of a topic, in any order, and which fields are filled; others may be too."""

    names: tuple[str, ...]
    filled: tuple[str, ...]


_TORQUE = Content(ACTIVE_JOINTS, ("effort",))

CONTENTS = {
    JOINT_STATES.name: Content(JOINTS, ("position",)),
    GROUND_TRUTH.name: Content(JOINTS, ("position", "velocity", "effort")),
    MOTOR_STATES.name: Content(ACTIVE_JOINTS, ("position",)),
    REFERENCE.name: Content(REFERENCE_NAMES, ("position", "velocity")),
    SUPERVISOR_STATE.name: Content(SUPERVISOR_NAMES, ("position",)),
    TORQUE_REQUESTED.name: _TORQUE,
    TORQUE_COMMAND.name: _TORQUE,
    ESTIMATE_COVARIANCE.name: Content(ESTIMATE_NAMES, ("position",)),
    ESTIMATE_DISTURBANCE.name: _TORQUE,
    VISION_PLATFORM.name: Content(VISION_NAMES, ("position",)),
    VISION_ERROR.name: Content(PLATFORM_NAMES, ("position",)),
}
"""Contents by topic; the candidates of laws are torques too."""


def content_of(topic: Topic) -> Content | None:
    """Return what the JointStates of a topic hold, None where that is not fixed."""
    return _TORQUE if topic.name.endswith("/torque") else CONTENTS.get(topic.name)


def belongs(message: Any, content: Content) -> bool:
    """Return whether a JointState has the names, lengths and filled fields of its topic, and a possible stamp."""
    stamp = message.header.stamp
    if not 0 <= stamp.sec * NANOSECONDS + stamp.nanosec <= LATEST_STAMP_NS:
        return False
    count = len(content.names)
    if len(message.name) != count or sorted(message.name) != sorted(content.names):
        return False
    return all(
        len(getattr(message, field)) == count or (field not in content.filled and not len(getattr(message, field)))
        for field in SEQUENCES
    )
