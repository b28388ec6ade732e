# SPDX-License-Identifier: Apache-2.0
"""Collects the readings of an IMU while something else goes on in the same thread."""

from __future__ import annotations

from typing import NamedTuple

from sensor_msgs.msg import Imu

from fivebar_description.imu import Vector3
from fivebar_description.interface import IMU_DATA
from fivebar_description.ros.domain_member import DomainMember
from fivebar_description.ros.messages import best_effort, stamp_of

DEPTH = 1000
"""Readings that may wait to be taken."""

MOST_AT_ONCE = 50


class StampedReading(NamedTuple):
    """A reading with its stamp (ns): angular velocity (rad/s) and acceleration (m/s^2) in the IMU's frame."""

    stamp: int
    angular_velocity: Vector3
    acceleration: Vector3


class ImuCollector(DomainMember):
    """Subscribes to the readings, whichever quality of service their driver has."""

    def __init__(self, domain: int) -> None:
        """Join a DDS domain."""
        super().__init__("fivebar_commission", domain)
        self.readings: list[StampedReading] = []
        """Readings so far."""
        self.node.create_subscription(Imu, IMU_DATA.name, self._keep, best_effort(DEPTH))

    def take_those_there(self) -> None:
        """Take the readings that have come, without waiting for any."""
        for _ in range(MOST_AT_ONCE):
            before = len(self.readings)
            self.take_one(0.0)
            if len(self.readings) == before:
                return

    def _keep(self, message: Imu) -> None:
        turn, force = message.angular_velocity, message.linear_acceleration
        self.readings.append(StampedReading(stamp_of(message), (turn.x, turn.y, turn.z), (force.x, force.y, force.z)))
