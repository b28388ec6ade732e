# SPDX-License-Identifier: Apache-2.0
"""Requests for motions through points, as messages."""

from __future__ import annotations

from builtin_interfaces.msg import Duration
from trajectory_msgs.msg import JointTrajectory, JointTrajectoryPoint

from fivebar_control.planning.timed_points import TimedPoints
from fivebar_control.planning.trajectory_messages import REQUEST
from fivebar_description.interface import NANOSECONDS


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
