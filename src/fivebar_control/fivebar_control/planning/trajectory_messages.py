# SPDX-License-Identifier: Apache-2.0
"""Requests for motions in messages of trajectory_msgs, as ROS or a reader of bags gives them."""

from __future__ import annotations

from typing import Any

from fivebar_control.planning.motion_queue import GoalRefused
from fivebar_control.planning.orders import TimedPoint
from fivebar_control.planning.timed_points import TimedPoints, read_points
from fivebar_description.interface import NANOSECONDS
from fivebar_description.outside_text import one_line

REQUEST = "request/"
"""How the frame of a message begins that is the id of a request, by which its statuses are known; coordinates are then
in the robot's own frame."""


def request_id_of(frame: str) -> str:
    """Return the id of the request that a message in a frame makes, "" where it has none."""
    return frame.removeprefix(REQUEST) if frame.startswith(REQUEST) else ""


def points_of(message: Any, base_frame: str) -> TimedPoints:
    """Return the points of a JointTrajectory.

    Args:
        message: the message.
        base_frame: the frame in which coordinates of the platform are.

    Raises:
        GoalRefused: it is to begin at a certain time, in another frame, with efforts, or its points make no request.
    """
    frame, stamp = message.header.frame_id.removeprefix("/"), message.header.stamp
    if frame not in ("", base_frame) and not frame.startswith(REQUEST):
        raise GoalRefused(f"header.frame_id {one_line(frame)!r}: expected {base_frame!r} or none")
    if stamp.sec or stamp.nanosec:
        raise GoalRefused("header.stamp: expected 0: a motion begins when it has been planned and screened")
    points = [_point(number, point) for number, point in enumerate(message.points)]
    return read_points(list(message.joint_names[:3]), points)


def _point(number: int, point: Any) -> TimedPoint:
    if len(point.effort):
        raise GoalRefused(f"points[{number}].effort: expected none: the controller finds the torques")
    since = point.time_from_start
    columns = (point.positions, point.velocities, point.accelerations)
    return TimedPoint(since.sec + since.nanosec / NANOSECONDS, *(tuple(map(float, column[:3])) for column in columns))
