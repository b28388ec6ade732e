# SPDX-License-Identifier: Apache-2.0
"""Places in the frames of a robot that do not move, as requests name them."""

from __future__ import annotations

from functools import cached_property

from fivebar_control.planning.motion_queue import GoalRefused
from fivebar_description.interface import BASE_FRAME, frame_prefix
from fivebar_description.outside_text import one_line
from fivebar_description.robot_description import robot_description
from fivebar_description.robot_file import read_robot
from fivebar_description.ros.node import GraphNode
from fivebar_description.static_frames import PlacedFrame, Vector, static_frames

OFF_PLANE = 0.05
"""Distance (m) from the plane of `base_link` up to which a place is taken to be in it, as high as the links are."""


class PlacedFrames:
    """The frames of a node's robot that are fixed to its base, in the namespace of the node."""

    def __init__(self, node: GraphNode, robot: str) -> None:
        """Take the frames from the URDF of a robot, by name or path, once a place is asked for."""
        self._prefix, self._robot = frame_prefix(node.get_namespace()), robot

    @cached_property
    def _frames(self) -> dict[str, PlacedFrame]:
        """The frames by their names in the namespace."""
        file = read_robot(self._robot)
        urdf = robot_description(file.five_bar(), file.name, weighed=file.weighed())
        return {f"{self._prefix}{name}": placed for name, placed in static_frames(urdf).items()}

    @property
    def base(self) -> str:
        """The frame of the base."""
        return f"{self._prefix}{BASE_FRAME}"

    def knows(self, frame: str) -> bool:
        """Return whether a frame is one of these."""
        return frame.removeprefix("/") in self._frames

    def unknown(self, frame: str, reason: str) -> GoalRefused:
        """Return the refusal of a frame that is none of these."""
        known = ", ".join(self._frames)
        return GoalRefused(f"frame {one_line(frame)!r}: expected one that is fixed to the base: {known}; {reason}")

    def in_plane(self, frame: str, point: Vector) -> tuple[float, float]:
        """Return a point (m) in one of these frames as a place (m) in the robot's plane.

        Raises:
            GoalRefused: the point is not in the plane.
        """
        x, y, z = self._frames[frame.removeprefix("/")].to_base(point)
        if abs(z) > OFF_PLANE:
            raise GoalRefused(
                f"({x:.4f}, {y:.4f}, {z:.4f}) m in {self.base}: expected a place in the robot's plane,"
                f" z at most {OFF_PLANE:g} m from 0"
            )
        return x, y
