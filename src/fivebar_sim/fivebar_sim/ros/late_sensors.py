# SPDX-License-Identifier: Apache-2.0
"""Messages of the sensors whose readings come late: the IMU, and those of one value."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

from sensor_msgs.msg import Imu

from fivebar_description.imu import ImuSettings, Vector3
from fivebar_description.interface import IMU_DATA, IMU_FRAME, Topic
from fivebar_description.joint_sample import JointSample
from fivebar_description.ros.messages import imu_message
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_sim.effects.gyroscope import GyroscopeFaults, ImuClock
from fivebar_sim.scalar_sensors import ScalarSensor
from fivebar_sim.sensors import ReadingQueue, imu_queue


class Arrived(NamedTuple):
    """The readings that come with a sample, each stamped with the moment at which it was made."""

    imu: list[Imu]
    scalars: list[tuple[Topic, JointSample]]


class LateSensors:
    """Makes the readings, keeps them until they are due, and publishes them."""

    def __init__(
        self,
        node: GraphNode,
        run: RunAgreement,
        rate_hz: int,
        imu: ImuSettings,
        seed: int,
        faults: GyroscopeFaults,
        scalars: Callable[[], list[ScalarSensor]],
    ) -> None:
        """Advertise the topics on behalf of a node.

        Args:
            node: which publishes.
            run: its agreement on the run.
            rate_hz: samples per second.
            imu: settings of the IMU.
            seed: of losses and jitter.
            faults: of the gyroscope.
            scalars: returns the sensors of one value at the beginning of a run.
        """
        self._run = run
        self._imu_frame = node.frame(IMU_FRAME)
        self._rate_hz = rate_hz
        self._settings, self._faults = imu, faults
        self._clock = ImuClock(imu, faults, rate_hz, seed)
        self._seed, self._make_scalars = seed, scalars
        self._imu = node.advertise(IMU_DATA)
        self.restart()
        self._senders = {scalar.topic.name: node.advertise(scalar.topic) for scalar in self.scalars}

    def restart(self) -> None:
        """Begin again with sample 0."""
        self._readings: ReadingQueue[Imu] = imu_queue(self._settings, self._faults, self._rate_hz, self._seed)
        self.scalars = self._make_scalars()

    def imu_message(self, sample: int, angular_velocity: Vector3, acceleration: Vector3 | None = None) -> Imu:
        """Return the message of a reading that is made at a sample (rad/s, m/s^2), stamped by the IMU's clock."""
        return imu_message(
            self._clock.stamp_ns(sample, self._run.epoch_ns), self._imu_frame, angular_velocity, acceleration
        )

    def arrived(self, sample: int, imu: Imu, position: tuple[float, ...]) -> Arrived:
        """Return what comes with a sample, given its own IMU message.

        Call it once per sample. Sensors of one value need the exact joint angles (rad).
        """
        scalars = [
            (reading.topic, JointSample(self._run.stamp(reading.made), (reading.name,), (reading.value,)))
            for sensor in self.scalars
            for reading in sensor.arrived(sample, position)
        ]
        return Arrived([message for _, message in self._readings.arrived(sample, imu)], scalars)

    def publish(self, arrived: Arrived) -> None:
        """Publish readings."""
        for message in arrived.imu:
            self._imu.publish(message)
        for topic, reading in arrived.scalars:
            self._senders[topic.name].publish(reading)
