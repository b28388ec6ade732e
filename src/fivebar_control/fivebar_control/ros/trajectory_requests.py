# SPDX-License-Identifier: Apache-2.0
"""Requests for motions through points, as messages."""

from __future__ import annotations

import struct

from builtin_interfaces.msg import Duration
from rclpy.serialization import deserialize_message
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from fivebar_control.planning.motion_queue import GoalRefused
from fivebar_control.planning.timed_points import TimedPoints
from fivebar_control.planning.trajectory_messages import REQUEST, points_of
from fivebar_description.interface import NANOSECONDS

FRAME_AT = 12
"""Where the length of a header's frame is in a serialised message: after its encoding and the stamp (bytes)."""


def trajectory_message(wanted: TimedPoints, request_id: str) -> JointTrajectory:
    """Return a request as a message; `goal/status` names the id with each of its statuses."""
    message = JointTrajectory(joint_names=list(wanted.joints))
    message.header.frame_id = f"{REQUEST}{request_id}"
    for time, position, velocity, acceleration in wanted.points:
        seconds, nanoseconds = divmod(round(time * NANOSECONDS), NANOSECONDS)
        since = Duration(sec=seconds, nanosec=nanoseconds)
        point = JointTrajectoryPoint(positions=position, velocities=velocity, accelerations=acceleration)
        point.time_from_start = since
        message.points.append(point)
    return message


def frame_of(data: bytes) -> str:
    """Return the frame of a serialised message that begins with a header, without reading the rest of it.

    Raises:
        GoalRefused: there is none.
    """
    order = "<" if data[1:2] == b"\x01" else ">"
    try:
        (length,) = struct.unpack_from(f"{order}I", data, FRAME_AT)
        return data[FRAME_AT + 4 : FRAME_AT + 3 + length].decode()
    except (struct.error, UnicodeDecodeError) as error:
        raise GoalRefused(f"header.frame_id: is not text: {error}") from None


def read_trajectory(data: bytes, base_frame: str) -> TimedPoints:
    """Return the points of a serialised JointTrajectory, as `points_of`; many take seconds.

    Raises:
        GoalRefused: it is none, or makes no request.
    """
    try:
        message = deserialize_message(data, JointTrajectory)
    except RuntimeError as error:
        raise GoalRefused(f"the message cannot be read: {error}") from None
    return points_of(message, base_frame)
