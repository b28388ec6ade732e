"""Compares the acceleration magnitude that the IMU measures with the desired one (4.3)."""

from __future__ import annotations

import math
from typing import Any

from sensor_msgs.msg import Imu
from std_msgs.msg import Float64

from fivebar_control.estimation.imu_check import acceleration_error
from fivebar_control.nodes.motion_parameters import RATE
from fivebar_description.interface import IMU_DATA, IMU_ERROR, REFERENCE, REFERENCE_NAMES
from fivebar_description.ros.messages import MessageError
from fivebar_description.ros.run import run_node
from fivebar_description.ros.sampling_node import Input, SamplingNode, fields_of


def read_imu(message: Imu) -> tuple[float, float]:
    """Return the in-plane linear acceleration (m/s^2) of an IMU message, in the IMU's frame.

    Raises:
        MessageError: a component is not finite.
    """
    measured = (message.linear_acceleration.x, message.linear_acceleration.y)
    if not all(math.isfinite(component) for component in measured):
        raise MessageError(f"linear acceleration is {measured}, expected finite numbers")
    return measured


class ImuListener(SamplingNode):
    """Publishes measured minus desired acceleration magnitude for every sample."""

    def __init__(self) -> None:
        """Make the node."""
        super().__init__("imu_listener")
        rate_hz = self.parameters((RATE,))["rate_hz"]
        self._error = self.advertise(IMU_ERROR)
        self.join(rate_hz, (Input(IMU_DATA, read_imu), Input(REFERENCE, fields_of(REFERENCE_NAMES, "velocity"))))

    def answer(self, sample: int, *values: Any) -> None:
        """Publish the acceleration error."""
        measured, ((_, _, ax, ay),) = values
        self._error.publish(Float64(data=acceleration_error(measured, (ax, ay))))


def main() -> None:
    """Run the node."""
    run_node(ImuListener)


if __name__ == "__main__":
    main()
