# SPDX-License-Identifier: Apache-2.0
"""Compares the acceleration magnitude that the IMU measures with the desired one (4.3)."""

from __future__ import annotations

from typing import Any

from diagnostic_msgs.msg import DiagnosticStatus
from sensor_msgs.msg import Imu
from std_msgs.msg import Float64

from fivebar_control.estimation.imu_check import ImuCheck
from fivebar_control.model.state import Platform
from fivebar_control.ros.node_settings import ImuListenerSettings
from fivebar_control.ros.run_file import start_values
from fivebar_control.scenario.keys import LEAD, ROBOT
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.imu import Vector3
from fivebar_description.interface import IMU_DATA, IMU_ERROR, REFERENCE, REFERENCE_NAMES
from fivebar_description.joint_sample import LARGEST, MessageError, fields_of
from fivebar_description.ros.file_parameters import FileParameters
from fivebar_description.ros.run import run_node
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_description.ros.sampling_node import QUEUE_DEPTH, Input, SamplingNode
from fivebar_description.run_plan import LEAD_SAMPLES

LONGEST_GAP = 5
"""Number of IMU readings that may be missing before that is reported."""


def read_imu(message: Imu) -> Vector3:
    """Return the linear acceleration (m/s^2) of an IMU message, in the IMU's frame.

    Raises:
        MessageError: a component is not finite or beyond `LARGEST`.
    """
    vector = message.linear_acceleration
    measured = (vector.x, vector.y, vector.z)
    if not all(-LARGEST <= component <= LARGEST for component in measured):
        raise MessageError(f"linear acceleration is {measured}, expected finite numbers of at most {LARGEST:g}")
    return measured


class ImuListener(SamplingNode):
    """Publishes measured minus desired acceleration magnitude for every sample; reports missing or saturated data."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("imu_listener")
        settings = self.declare_settings(ImuListenerSettings)
        scenario = FileParameters(self, ControlScenario, (*ROBOT, *LEAD, "imu")).file
        RunAgreement(self, scenario.rate_hz, {**start_values(scenario), LEAD_SAMPLES: scenario.lead_samples})
        self._arguments = (scenario.five_bar(), scenario.working_mode, scenario.rate_hz, scenario.imu)
        self._check = ImuCheck(*self._arguments)
        schedule = scenario.imu.schedule(scenario.rate_hz)
        self._longest_gap = LONGEST_GAP * schedule.every + schedule.latency
        self._saturated = 0
        self._error = self.advertise(IMU_ERROR)
        # an IMU reading is valid at the time of its stamp, a reference at a time `lead_samples` later
        read_reference = fields_of(REFERENCE_NAMES, "position", "velocity")
        inputs = (Input(IMU_DATA, read_imu), Input(REFERENCE, read_reference, scenario.lead_samples))
        self.join(scenario.rate_hz, inputs, QUEUE_DEPTH)
        self.wait_for_publishers(settings.wait_for_nodes)

    def stop(self) -> None:
        """Process queued samples before shutdown: the run does not wait for this node."""
        self.drain()

    def restart(self) -> None:
        """Reset the low-pass filter for a new run."""
        self._check = ImuCheck(*self._arguments)

    def answer(self, sample: int, *values: Any) -> None:
        """Publish the acceleration error."""
        measured, ((x, y, vx, vy), (_, _, ax, ay)) = values
        self._saturated += self._check.saturated(measured)
        self._error.publish(Float64(data=self._check.error(measured, Platform(x, y, vx, vy, ax, ay))))

    def health(self) -> tuple[bytes, str]:
        """Return a warning when the IMU's data are missing or saturated."""
        waiting = self.waiting_samples(IMU_DATA)
        if waiting > self._longest_gap:
            return DiagnosticStatus.WARN, f"no IMU data for {waiting} samples of the reference"
        if self._saturated:
            return DiagnosticStatus.WARN, f"{self._saturated} samples with a saturated axis"
        return super().health()


def main() -> None:
    """Run the node."""
    run_node(ImuListener)


if __name__ == "__main__":
    main()
