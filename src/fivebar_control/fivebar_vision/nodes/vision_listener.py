# SPDX-License-Identifier: Apache-2.0
"""Finds the platform in the camera's pictures, and compares it with where the joints have it."""

from __future__ import annotations

import math
from pathlib import Path

from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import CameraInfo, Image

from fivebar_control.estimation.platform_reading import PlatformReading
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.scenario.keys import LEAD
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.errors import InputError
from fivebar_description.interface import (
    CAMERA_IMAGE,
    CAMERA_INFO,
    JOINT_STATES,
    JOINTS,
    NANOSECONDS,
    PLATFORM_NAMES,
    VISION_ERROR,
    VISION_NAMES,
    VISION_PLATFORM,
)
from fivebar_description.joint_sample import JointSample, MessageError
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.messages import checked_stamp
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run import run_node
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_description.ros.sampling_node import QUEUE_DEPTH
from fivebar_description.run_plan import LEAD_SAMPLES, robot_value
from fivebar_description.shared_settings import REALTIME
from fivebar_vision.camera_file import CameraCalibration, read_calibration
from fivebar_vision.comparison import Position, VisionCheck
from fivebar_vision.localisation import PlatformTracker
from fivebar_vision.messages import calibration_of, picture_of
from fivebar_vision.node_settings import VisionListenerSettings
from fivebar_vision.picture_reading import reading_of

PICTURES = 16
"""Largest number of pictures that wait; older ones are of no use."""

FRESH_PICTURES = 2
"""Largest number of pictures that wait in real time."""


class VisionListener(GraphNode):
    """Publishes the platform's position for every picture, NaN where it is not seen, and its difference to the joints'.

    The camera's optics are those of its calibration, or else what its CameraInfo says.
    """

    in_chain = True

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("vision_listener")
        settings = self.declare_settings(VisionListenerSettings)
        scenario = FileParameters(self, ControlScenario, ("robot", "rate_hz", *LEAD, "camera")).file
        self._camera, self._rate_hz = scenario.camera, scenario.rate_hz
        self._robot, self._lead = scenario.five_bar(), scenario.lead_samples
        agreed = {"robot": robot_value(scenario.robot), LEAD_SAMPLES: scenario.lead_samples}
        self._run = RunAgreement(self, scenario.rate_hz, agreed)
        self._run.on_begin = self._restart
        path = self._camera.calibration
        self._source = path or f"topic {CAMERA_INFO.name}"
        self._calibration: CameraCalibration | None = read_calibration(Path(path)) if path else None
        self._tracked = (0, 0)
        self._early: list[Image] = []
        self._unseen = self._pictures = 0
        self._restart()
        self._platform = self.advertise(VISION_PLATFORM)
        self._errors = self.advertise(VISION_ERROR)
        self.listen(CAMERA_INFO, self._on_info)
        self.listen(CAMERA_IMAGE, self._on_image, FRESH_PICTURES if settings.mode == REALTIME else PICTURES)
        self.listen(JOINT_STATES, self._on_joints, QUEUE_DEPTH)
        self.wait_for_publishers(settings.wait_for_nodes)

    def stop(self) -> None:
        """Process queued pictures before shutdown: the run does not wait for this node."""
        self.drain()

    def health(self) -> tuple[bytes, str]:
        """Return a warning where the platform is often not seen."""
        if 2 * self._unseen > self._pictures > 0:
            seen = self._pictures - self._unseen
            return DiagnosticStatus.WARN, f"the platform is in {seen} of {self._pictures} pictures"
        return super().health()

    def _restart(self) -> None:
        self._check = VisionCheck(self._rate_hz, self._lead)
        self._tracker: PlatformTracker | None = None
        self._last: tuple[PlatformReading, int] | None = None
        self._last_stamp = self._last_joints = -1

    def _on_info(self, message: CameraInfo) -> None:
        if self._calibration is not None:
            return
        try:
            self._calibration = calibration_of(message)
        except MessageError as error:
            self.drop(CAMERA_INFO, str(error))
            return
        self._restart()
        early, self._early = self._early, []
        for image in early:
            self._on_image(image)

    def _on_image(self, message: Image) -> None:
        if not self._run.holds or self.refuses(CAMERA_IMAGE):
            return
        if self._calibration is None:
            self._early = [*self._early[1 - PICTURES :], message]
            return
        try:
            picture, stamp = picture_of(message), checked_stamp(message)
        except MessageError as error:
            self.drop(CAMERA_IMAGE, str(error))
            return
        tracker = self._tracker_of(message.width, message.height, self._calibration)
        if tracker is None:
            return
        if stamp != self._last_stamp or self._last is None:
            self._last = reading_of(tracker, self._camera, picture)
            self._last_stamp = stamp
            self._pictures += 1
            self._unseen += not math.isfinite(self._last[0].x)
            reading, late = self._last
            self._compare(self._check.seen(self._run.moment(stamp + late), reading))
            self.note_answer()
        reading, late = self._last
        self._platform.publish(JointSample(stamp + late, VISION_NAMES, reading))

    def _tracker_of(self, width: int, height: int, calibration: CameraCalibration) -> PlatformTracker | None:
        """Return what finds the platform in pictures of a size (px); None where the calibration is of another shape."""
        if self._tracker is None or (width, height) != self._tracked:
            try:
                optics = calibration.optics_for(width, height, self._source)
            except InputError as error:
                self.drop(CAMERA_IMAGE, str(error))
                return None
            self._tracker, self._tracked = PlatformTracker(self._camera, optics), (width, height)
        return self._tracker

    def _on_joints(self, message: JointSample) -> None:
        if not self._run.holds:
            return
        read = self._run.read(JOINT_STATES, message, JOINTS, ("position", "velocity"))
        if read is None:
            return
        sample, (position, velocity) = read
        if sample == self._last_joints:
            return
        if sample == 0 and self._last_joints > 0:
            self._restart()
        self._last_joints = sample
        state = state_from_joints(self._robot, *position, *velocity)
        self._compare(self._check.joints(sample, state.x, state.y))

    def _compare(self, compared: list[tuple[float, Position]]) -> None:
        period_ns = NANOSECONDS // self._rate_hz
        for moment, difference in compared:
            stamp = self._run.stamp(0) + round(moment * period_ns)
            self._errors.publish(JointSample(stamp, PLATFORM_NAMES, difference))


def main() -> None:
    """Run the node."""
    run_node(VisionListener)


if __name__ == "__main__":
    main()
