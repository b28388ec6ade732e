# SPDX-License-Identifier: Apache-2.0
"""Motions as nav_msgs/Path and geometry_msgs/PoseStamped, for tools that show these."""

from __future__ import annotations

from collections.abc import Callable

from geometry_msgs.msg import PoseStamped
from nav_msgs.msg import Path as PathMessage

from fivebar_control.trajectory.path import Path
from fivebar_description.interface import BASE_FRAME, GOAL_PATH, GOAL_TARGET, NANOSECONDS, RUN_PATH
from fivebar_description.ros.messages import to_stamp
from fivebar_description.ros.node import GraphNode

POSES = 50
"""Poses of a path, evenly spread over its time: few, since they are published between two samples."""


def show_plan(node: GraphNode, path: Path, rate_hz: int) -> None:
    """Publish where a run's plan goes, without stamps: when it begins is not known yet."""
    node.advertise(RUN_PATH).publish(_path_message(node.frame(BASE_FRAME), path, rate_hz, lambda sample: 0))


class ShownMotions:
    """Publishes where requested motions go."""

    def __init__(self, node: GraphNode) -> None:
        """Publish on behalf of a node."""
        self._frame = node.frame(BASE_FRAME)
        self._path, self._target = node.advertise(GOAL_PATH), node.advertise(GOAL_TARGET)

    def show_goal(self, path: Path, rate_hz: int, begin_ns: int, goal: tuple[float, float]) -> None:
        """Publish a motion that begins at a stamp (ns), each pose with the stamp at which the platform is there."""
        period = NANOSECONDS // rate_hz
        self._path.publish(_path_message(self._frame, path, rate_hz, lambda sample: begin_ns + sample * period))
        last = begin_ns + path.samples(rate_hz) * period
        self._target.publish(_pose(self._frame, *goal, last))


def _path_message(frame: str, path: Path, rate_hz: int, stamp: Callable[[int], int]) -> PathMessage:
    message = PathMessage()
    message.header.frame_id = frame
    message.header.stamp = to_stamp(stamp(0))
    last = path.samples(rate_hz)
    for number in range(POSES + 1):
        sample = number * last // POSES
        place = path.at(sample / rate_hz)
        message.poses.append(_pose(frame, place.x, place.y, stamp(sample)))
    return message


def _pose(frame: str, x: float, y: float, stamp_ns: int) -> PoseStamped:
    message = PoseStamped()
    message.header.frame_id = frame
    message.header.stamp = to_stamp(stamp_ns)
    message.pose.position.x, message.pose.position.y = x, y
    message.pose.orientation.w = 1.0
    return message
