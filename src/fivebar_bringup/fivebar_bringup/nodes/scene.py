# SPDX-License-Identifier: Apache-2.0
"""Publishes pictures of a run as markers, for RViz and Foxglove: no transform and no URDF is needed to see them.

The node only looks on: it takes what arrives without asking for what is lost, and no other node waits for it.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable
from typing import Any

from geometry_msgs.msg import Point as PointMessage
from sensor_msgs.msg import JointState
from std_msgs.msg import ColorRGBA
from visualization_msgs.msg import Marker, MarkerArray

from fivebar_bringup.scene.map import loci_shapes, path_shapes
from fivebar_bringup.scene.moving import SceneSample, Trail, moving_shapes
from fivebar_bringup.scene.settings import SceneSettings
from fivebar_bringup.scene.shapes import Colour, Kind, Shape
from fivebar_control.model.kinematics import state_from_joints, working_mode
from fivebar_control.ros.run_file import declared_motion
from fivebar_control.scenario.keys import MOTION
from fivebar_control.scenario.motion_file import MotionFile
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    BASE_FRAME,
    JOINT_STATES,
    JOINTS,
    NANOSECONDS,
    PICTURES,
    REFERENCE,
    REFERENCE_NAMES,
    TORQUE_COMMAND,
    Topic,
)
from fivebar_description.joint_sample import MessageError
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.messages import (
    best_effort,
    checked_stamp,
    own_fields,
    received_joint_state,
    stamp_of,
    to_stamp,
)
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run import run_node

BACKLOG = 256
"""Messages of a topic kept between two pictures; the newest where there are more."""

STATES_OF_TRAIL = 4
"""Every so many joint states one is read, for the trail."""

TRAIL_PERIOD = 0.2
"""Time (s) between two messages of the trail, by far the largest."""


class Inbox:
    """The newest messages of a topic, read only when a picture is due."""

    def __init__(self, node: GraphNode, topic: Topic) -> None:
        """Subscribe without acknowledgement, so that a publisher never has to do with a slow picture."""
        self._node, self._topic = node, topic
        self._messages: deque[bytes] = deque(maxlen=BACKLOG)
        node.create_subscription(JointState, topic.name, self._keep, best_effort(BACKLOG), raw=True)

    def _keep(self, message: bytes) -> None:
        self._messages.append(message)

    def take(self, every: int) -> list[JointState]:
        """Return every n-th message since the last time, oldest first, and always the newest."""
        chosen = list(self._messages)[::-every][::-1]
        self._messages.clear()
        return [message for data in chosen if (message := self._read(data)) is not None]

    def _read(self, data: bytes) -> JointState | None:
        """Return a message, None where there is none or its stamp is impossible."""
        try:
            message = received_joint_state(data)
            checked_stamp(message)
        except MessageError as error:
            self._node.drop(self._topic, str(error))
            return None
        return message


class Scene(GraphNode):
    """Draws the robot at every picture, and the map when it starts and where the working mode changes."""

    def __init__(self) -> None:
        """Make the node and publish the map."""
        super().__init__("scene")
        scenario = FileParameters(self, MotionFile, MOTION).file
        self._motion = declared_motion(self, scenario)
        self._settings = self.declare_settings(SceneSettings)
        self._frame = self._settings.frame_id or self.frame(BASE_FRAME)
        self._zones = scenario.min_authority > 0.0
        self._period_ns = round(NANOSECONDS / self._settings.pictures_per_second)
        self._trail = Trail(self._settings.trail_points)
        self._torque: tuple[float, float] | None = None
        self._reference: tuple[float, float] | None = None
        self._shown_ns = self._newest_ns = -1
        self._undrawn = 0
        self._pictures, self._trails, self._map = (self.advertise(topic) for topic in PICTURES)
        self._mode = self._motion.plan.mode
        self._publish_map(0)
        self._states = Inbox(self, JOINT_STATES)
        self._references = Inbox(self, REFERENCE)
        self._commands = Inbox(self, TORQUE_COMMAND)
        self.every(1.0 / self._settings.pictures_per_second, self._draw)

    def stop(self) -> None:
        """Draw the end of the run."""
        self._draw(last=True)

    def _draw(self, last: bool = False) -> None:
        for message in self._references.take(BACKLOG):
            fields = self._read(REFERENCE, message, REFERENCE_NAMES, "position")
            self._reference = fields[0][:2] if fields else self._reference
        for message in self._commands.take(BACKLOG):
            fields = self._read(TORQUE_COMMAND, message, ACTIVE_JOINTS, "effort")
            self._torque = fields[0] if fields else self._torque
        state = None
        for message in self._states.take(STATES_OF_TRAIL):
            fields = self._read(JOINT_STATES, message, JOINTS, "position", "velocity")
            if not fields:
                continue
            stamp = stamp_of(message)
            if stamp < self._newest_ns:
                # another run has begun
                self._trail.clear()
                self._shown_ns = -1
            self._newest_ns = stamp
            state = state_from_joints(self._motion.robot, *fields[0], *fields[1])
            self._trail.add(state)
        if state is None or (0 <= self._newest_ns - self._shown_ns < self._period_ns and not last):
            return
        self._shown_ns = self._newest_ns
        mode = working_mode(state)
        if mode != self._mode:
            self._mode = mode
            self._publish_map(self._newest_ns)
        moment = SceneSample(state, self._torque, self._reference)
        shapes = moving_shapes(self._motion.robot, moment, self._settings)
        self._pictures.publish(self._markers(shapes, self._newest_ns))
        self._undrawn += 1
        if last or self._undrawn >= TRAIL_PERIOD * self._settings.pictures_per_second:
            self._undrawn = 0
            self._trails.publish(self._markers([self._trail.shape()], self._newest_ns))
        self.note_answer()

    def _read(self, topic: Topic, message: JointState, names: tuple[str, ...], *fields: str) -> tuple[Any, ...]:
        """Return fields of a message, () where it is malformed."""
        try:
            return own_fields(message, names, fields)
        except MessageError as error:
            self.drop(topic, str(error))
            return ()

    def _publish_map(self, stamp_ns: int) -> None:
        robot, plan = self._motion.robot, self._motion.plan
        shapes = [*loci_shapes(robot, self._mode), *path_shapes(robot, plan, self._zones)]
        self._map.publish(self._markers(shapes, stamp_ns))

    def _markers(self, shapes: Iterable[Shape], stamp_ns: int) -> MarkerArray:
        return MarkerArray(markers=[marker_of(shape, stamp_ns, self._frame) for shape in shapes])


def marker_of(shape: Shape, stamp_ns: int, frame_id: str) -> Marker:
    """Return a shape as a marker: its points in the frame, its pose the identity but for a text."""
    marker = Marker(ns=shape.group, id=shape.number, type=int(shape.kind))
    marker.header.frame_id = frame_id
    marker.header.stamp = to_stamp(stamp_ns)
    if not shape.points:
        marker.action = Marker.DELETE
        return marker
    marker.action = Marker.ADD
    marker.pose.orientation.w = 1.0
    marker.color = _colour(shape.colour)
    scale = marker.scale
    if shape.kind is Kind.TEXT:
        marker.text = shape.text
        marker.pose.position.x, marker.pose.position.y, marker.pose.position.z = shape.points[0]
        scale.z = shape.size
        return marker
    marker.points = [PointMessage(x=x, y=y, z=z) for x, y, z in shape.points]
    marker.colors = [_colour(colour) for colour in shape.colours]
    scale.x = shape.size
    if shape.kind is Kind.SPHERES:
        scale.y = scale.z = shape.size
    elif shape.kind is Kind.ARROW:
        # the shaft's and the head's diameter, and the head's length
        scale.y, scale.z = 2.0 * shape.size, 2.0 * shape.size
    return marker


def _colour(colour: Colour) -> ColorRGBA:
    red, green, blue, opacity = colour
    return ColorRGBA(r=red, g=green, b=blue, a=opacity)


def main() -> None:
    """Run the node."""
    run_node(Scene)


if __name__ == "__main__":
    main()
