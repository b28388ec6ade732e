# SPDX-License-Identifier: Apache-2.0
"""The IMU's readings beside a motion by hand, whatever quality of service their driver has."""

from __future__ import annotations

import pytest
from graph_probe import Bench
from rclpy.qos import QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import Imu

from fivebar_bringup.ros.imu_collector import ImuCollector, StampedReading
from fivebar_description.interface import IMU_DATA
from fivebar_description.ros.domain_member import DomainMember

DEADLINE = 30.0


@pytest.mark.parametrize("reliability", [ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_EFFORT])
def test_readings_keep_their_stamps_and_none_is_waited_for(bench: Bench, reliability: ReliabilityPolicy) -> None:
    with DomainMember("driver", bench.domain) as driver, ImuCollector(bench.domain) as collector:
        publisher = driver.node.create_publisher(Imu, IMU_DATA.name, QoSProfile(depth=100, reliability=reliability))
        collector.take_those_there()
        assert collector.readings == []

        def heard() -> bool:
            # what is sent before both sides know of each other is lost
            publisher.publish(Imu())
            return bool(collector.readings)

        assert collector.wait_for(heard, DEADLINE)

        def arrived() -> list[StampedReading]:
            return [one for one in collector.readings if one.stamp]

        for number in range(20):
            message = Imu()
            message.header.stamp.sec, message.header.stamp.nanosec = 3, number
            message.angular_velocity.z = float(number)
            message.linear_acceleration.x = -float(number)
            publisher.publish(message)
            assert collector.wait_for(lambda: len(arrived()) > number, DEADLINE)  # noqa: B023
        assert [one.stamp for one in arrived()] == [3_000_000_000 + number for number in range(20)]
        assert arrived()[7].angular_velocity == (0.0, 0.0, 7.0)
        assert arrived()[7].acceleration == (-7.0, 0.0, 0.0)
