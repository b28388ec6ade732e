# SPDX-License-Identifier: Apache-2.0
"""Messages of the sensors whose readings come late: the IMU, and the encoder on a passive joint."""

from __future__ import annotations

from typing import NamedTuple

from sensor_msgs.msg import Imu

from fivebar_description.imu import ImuSettings, Vector3
from fivebar_description.interface import IMU_DATA, IMU_FRAME, PASSIVE_STATES, late_stamp_ns
from fivebar_description.joint_sample import JointSample
from fivebar_description.ros.messages import imu_message
from fivebar_description.ros.node import GraphNode
from fivebar_description.ros.run_agreement import RunAgreement
from fivebar_description.sensors import PassiveEncoder
from fivebar_sim.effects.gyroscope import GyroscopeFaults, ImuClock
from fivebar_sim.sensors import PASSIVE_LOSSES, ReadingQueue, imu_queue, passive_numbers, passive_reading


class Arrived(NamedTuple):
    """The readings that come with a sample, each stamped with the moment at which it was made."""

    imu: list[Imu]
    angles: list[JointSample]


class LateSensors:
    """Makes the readings, keeps them until they are due, and publishes them."""

    def __init__(
        self,
        node: GraphNode,
        run: RunAgreement,
        rate_hz: int,
        imu: ImuSettings,
        passive: PassiveEncoder,
        seed: int,
        faults: GyroscopeFaults,
    ) -> None:
        """Advertise the topics on behalf of a node; the seed is that of losses, jitter and of the encoder's phase."""
        self._run = run
        self._imu_frame = node.frame(IMU_FRAME)
        self._rate_hz = rate_hz
        self._settings, self._faults = imu, faults
        self._clock = ImuClock(imu, faults, rate_hz, seed)
        self.passive = passive
        self._seed = seed
        self._encoder = passive_numbers(passive, seed)
        self._imu = node.advertise(IMU_DATA)
        self._passive_states = node.advertise(PASSIVE_STATES) if passive.leg else None
        self.restart()

    def restart(self) -> None:
        """Begin again with sample 0."""
        self._readings: ReadingQueue[Imu] = imu_queue(self._settings, self._faults, self._rate_hz, self._seed)
        self._angles: ReadingQueue[JointSample] = ReadingQueue(self.passive, self._rate_hz, self._seed, PASSIVE_LOSSES)

    def imu_message(self, sample: int, angular_velocity: Vector3, acceleration: Vector3 | None = None) -> Imu:
        """Return the message of a reading that is made at a sample (rad/s, m/s^2), stamped by the IMU's clock."""
        stamp = late_stamp_ns(sample, self._rate_hz, self._clock.offset(sample), self._run.epoch_ns)
        return imu_message(stamp, self._imu_frame, angular_velocity, acceleration)

    def arrived(self, sample: int, imu: Imu, position: tuple[float, ...]) -> Arrived:
        """Return what comes with a sample, given its own IMU message.

        Call it once per sample. With an encoder on a passive joint, it needs the true joint angles (rad).
        """
        angles: list[tuple[int, JointSample]] = []
        if self.passive.leg:
            angle = passive_reading(self._encoder, position[self.passive.place])
            message = JointSample(self._run.stamp(sample), (self.passive.joint,), (angle,))
            angles = self._angles.arrived(sample, message)
        return Arrived([one for _, one in self._readings.arrived(sample, imu)], [one for _, one in angles])

    def publish(self, arrived: Arrived) -> None:
        """Publish readings."""
        for message in arrived.imu:
            self._imu.publish(message)
        if self._passive_states is not None:
            for reading in arrived.angles:
                self._passive_states.publish(reading)
