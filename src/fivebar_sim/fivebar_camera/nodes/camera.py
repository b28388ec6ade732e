# SPDX-License-Identifier: Apache-2.0
"""The simulated camera as a node: pictures of the robot as it moves, late and some lost."""

from __future__ import annotations

import os
from array import array

import numpy as np
from sensor_msgs.msg import CameraInfo, Image

from fivebar_camera.camera import Camera, Delivered
from fivebar_camera.node_settings import CameraNodeSettings
from fivebar_camera.renderer import Picture
from fivebar_description.camera import CameraSettings
from fivebar_description.interface import (
    CAMERA_IMAGE,
    CAMERA_INFO,
    GROUND_TRUTH,
    JOINTS,
    NANOSECONDS,
    PICTURE_FRAME,
    VISION_NAMES,
    VISION_PLATFORM,
)
from fivebar_description.joint_sample import JointSample
from fivebar_description.robot_file import load_robot
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.messages import to_stamp
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run import run_node
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_description.ros.sampling_node import QUEUE_DEPTH
from fivebar_description.run_plan import robot_value
from fivebar_description.shared_settings import REALTIME
from fivebar_optics.camera_model import LENS_MODEL, nominal_optics
from fivebar_sim.effects.mechanism import actual_robot
from fivebar_sim.scenario import SimulatedRobot

LATEST_START = 0.04
"""Age (s) of a sample beyond which it is not rendered in real time: what was seen would come too late to be of use."""

LOW_PRIORITY = 10
"""Niceness in real time: a picture may be late or left out, a torque may not."""


class CameraNode(GraphNode):
    """Follows the exact joint states, and publishes each picture with the sample with which it arrives.

    In real time an exposure is left out where its sample is too old by the time that it could be rendered, so that a
    machine that is too slow for the rate gives fewer pictures and not ever older ones.

    Without pictures it publishes the platform's position in the listener's place.
    """

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("camera")
        settings = self.declare_settings(CameraNodeSettings)
        file = FileParameters(self, SimulatedRobot, ("robot", "rate_hz", "estimator", "camera", "plant")).file
        self._settings, self._plant, self._rate_hz = file.camera, file.plant, file.rate_hz
        self._robot = actual_robot(load_robot(file.robot), self._plant)
        self._run = RunAgreement(self, self._rate_hz, {"robot": robot_value(file.robot)})
        self._run.on_begin = self._restart
        self._restart()
        self._info = _camera_info(self._settings, self.frame(PICTURE_FRAME))
        self._by_the_clock = settings.mode == REALTIME
        if self._by_the_clock:
            os.nice(LOW_PRIORITY)
        if self._settings.pictures:
            self._images = self.advertise(CAMERA_IMAGE)
            self._infos = self.advertise(CAMERA_INFO)
        else:
            self._positions = self.advertise(VISION_PLATFORM)
        self.listen(GROUND_TRUTH, self._on_joints, QUEUE_DEPTH)
        self.wait_for_publishers(settings.wait_for_nodes)

    def _restart(self) -> None:
        self._camera = Camera(self._robot, self._settings, self._rate_hz, self._plant.seed)
        self._last = -1
        self._delivered: list[Delivered] = []

    def _on_joints(self, message: JointSample) -> None:
        if not self._run.holds:
            return
        read = self._run.read(GROUND_TRUTH, message, JOINTS, ("position", "velocity"))
        if read is None:
            return
        sample, (position, velocity) = read
        if sample == 0 and self._last > 0:
            self._restart()
        if sample > self._last:
            self._delivered = self._camera.take(sample, position, velocity, self._is_late(sample))
            self._last = sample
            self.note_answer()
        elif sample < self._last:
            return
        # a repeated sample: its pictures may have been lost
        for delivered in self._delivered:
            self._publish(delivered)

    def _is_late(self, sample: int) -> bool:
        age_ns = self.get_clock().now().nanoseconds - self._run.stamp(sample)
        return self._by_the_clock and sample > 0 and age_ns > LATEST_START * NANOSECONDS

    def _publish(self, delivered: Delivered) -> None:
        stamp = self._camera.stamp_ns(self._run.stamp(delivered.sample))
        if delivered.picture is None:
            spread = self._settings.deviation
            self._positions.publish(JointSample(stamp, VISION_NAMES, (delivered.x, delivered.y, spread, spread, 0.0)))
            return
        self._info.header.stamp = to_stamp(stamp)
        self._infos.publish(self._info)
        self._images.publish(_image(delivered.picture, stamp, self.frame(PICTURE_FRAME)))


def _image(picture: Picture, stamp_ns: int, frame: str) -> Image:
    height, width = picture.shape
    message = Image(height=height, width=width, encoding="mono8", is_bigendian=0, step=width)
    message.header.stamp = to_stamp(stamp_ns)
    message.header.frame_id = frame
    message.data = array("B", picture.tobytes())
    return message


def _camera_info(settings: CameraSettings, frame: str) -> CameraInfo:
    optics = nominal_optics(settings)
    message = CameraInfo(height=settings.height, width=settings.width, distortion_model=LENS_MODEL)
    message.header.frame_id = frame
    message.d = optics.distortion().tolist()
    message.k = optics.matrix().ravel().tolist()
    message.r = np.eye(3).ravel().tolist()
    message.p = optics.projection().ravel().tolist()
    return message


def main() -> None:
    """Run the node."""
    run_node(CameraNode)


if __name__ == "__main__":
    main()
