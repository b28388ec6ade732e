# SPDX-License-Identifier: Apache-2.0
"""Requests for motions in messages of trajectory_msgs."""

from __future__ import annotations

from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from fivebar_control.planning.motion_queue import GoalRefused
from fivebar_control.planning.timed_points import MOST_POINTS, TimedPoint
from fivebar_description.interface import NANOSECONDS
from fivebar_description.outside_text import one_line


def points_of(message: JointTrajectory, base_frame: str) -> tuple[list[str], list[TimedPoint]]:
    """Return the names and points of a message.

    Args:
        message: the message.
        base_frame: the frame in which coordinates of the platform are.

    Raises:
        GoalRefused: it is to begin at a certain time, in another frame, or with efforts.
    """
    frame, stamp = message.header.frame_id.removeprefix("/"), message.header.stamp
    if frame not in ("", base_frame):
        raise GoalRefused(f"header.frame_id {one_line(frame)!r}: expected {base_frame!r} or none")
    if stamp.sec or stamp.nanosec:
        raise GoalRefused("header.stamp: expected 0: a motion begins when it has been planned and screened")
    # of what is too long only so much is read that it is seen to be
    points = message.points[: MOST_POINTS + 1]
    return message.joint_names[:3], [_point(number, point) for number, point in enumerate(points)]


def _point(number: int, point: JointTrajectoryPoint) -> TimedPoint:
    if len(point.effort):
        raise GoalRefused(f"points[{number}].effort: expected none: the controller finds the torques")
    since = point.time_from_start
    columns = (point.positions, point.velocities, point.accelerations)
    return TimedPoint(since.sec + since.nanosec / NANOSECONDS, *(tuple(column[:3]) for column in columns))
