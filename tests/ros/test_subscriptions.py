# SPDX-License-Identifier: Apache-2.0
"""Which publishers a node hears: those of sensors and users whatever they offer, others as it says or is told."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import pytest
from graph_probe import Bench, Probe
from rclpy.event_handler import PublisherEventCallbacks
from rclpy.qos import QoSProfile, ReliabilityPolicy, qos_profile_sensor_data
from sensor_msgs.msg import Imu, JointState
from std_msgs.msg import Float64

from fivebar_bringup.runs.node_processes import NOT_READY, WAITS
from fivebar_description.interface import IMU_DATA, MOTOR_STATES, PAYLOAD, Topic
from fivebar_description.ros.messages import message_class

RELIABLE = QoSProfile(depth=10)
"""The default of `create_publisher(..., 10)` and of `ros2 topic pub`: reliable and volatile."""

NODE = "/state_estimator"

GYRO = {"ekf.gyro": True}

OVERRIDE = "qos_overrides./motor_states.subscription"


def malformed_imu() -> Imu:
    message = Imu()
    message.angular_velocity.x = math.nan
    return message


MALFORMED: dict[Topic, Callable[[], Any]] = {
    IMU_DATA: malformed_imu,
    PAYLOAD: lambda: Float64(data=-1.0),
}
"""Messages that a node counts as dropped."""


def dropped(probe: Probe) -> int:
    """Return how many messages the node has dropped by now."""
    return int(probe.health(NODE)[1]["dropped"])


def expect_heard_once(probe: Probe, topic: Topic, profile: QoSProfile) -> None:
    """Publish with a quality of service until the node hears it, then once more."""
    publisher, message = probe.node.create_publisher(message_class(topic), topic.name, profile), MALFORMED[topic]()
    before = dropped(probe)

    def is_heard() -> bool:
        # without acknowledgement, what is published before the node knows of the publisher is lost
        publisher.publish(message)
        return dropped(probe) > before

    probe.wait_for(is_heard, f"{topic.name} is heard")
    before = dropped(probe)
    publisher.publish(message)
    probe.wait_for_dropped(NODE, before + 1)
    # a topic of a sensor has one publisher
    probe.node.destroy_publisher(publisher)


def said(probe: Probe, text: str) -> None:
    """Wait until the node's diagnostics contain a text."""
    probe.wait_for(lambda: any(text in status.message for status in probe.reports[NODE]), text)


@pytest.mark.extra
def test_publishers_that_offer_less_and_more_are_heard_once_each(bench: Bench) -> None:
    bench.start("state_estimator", **GYRO, mode="realtime", compiled="no")
    probe = bench.probe()
    probe.health(NODE)
    for topic in MALFORMED:
        for profile in (qos_profile_sensor_data, RELIABLE):
            expect_heard_once(probe, topic, profile)


@pytest.mark.parametrize("profile", [qos_profile_sensor_data, RELIABLE], ids=["best_effort", "reliable"])
def test_a_sensor_is_subscribed_to_once_as_its_driver_offers(bench: Bench, profile: QoSProfile) -> None:
    """So a driver with best effort is not told that nothing is sent, and of a reliable one nothing is lost."""
    probe, told = bench.probe(), []
    events = PublisherEventCallbacks(incompatible_qos=told.append)
    publisher = probe.node.create_publisher(Imu, IMU_DATA.name, profile, event_callbacks=events)
    bench.start("state_estimator", **GYRO, mode="realtime", compiled="no")

    def asked() -> list[ReliabilityPolicy]:
        return [one.qos_profile.reliability for one in probe.node.get_subscriptions_info_by_topic(IMU_DATA.name)]

    probe.wait_for(lambda: asked() == [profile.reliability], "the subscription that suits")
    before = dropped(probe)
    publisher.publish(malformed_imu())
    probe.wait_for_dropped(NODE, before + 1)
    assert not told
    assert asked() == [profile.reliability]


def test_a_latched_message_from_before_the_node_is_heard(bench: Bench) -> None:
    probe = bench.probe()
    probe.publish(PAYLOAD, MALFORMED[PAYLOAD]())
    bench.start("state_estimator")
    probe.wait_for_dropped(NODE, 1)


@pytest.mark.extra
def test_in_lockstep_a_sensor_that_may_lose_readings_is_not_used_but_named(bench: Bench) -> None:
    process = bench.start("state_estimator", **GYRO)
    probe = bench.probe()
    probe.node.create_publisher(Imu, IMU_DATA.name, qos_profile_sensor_data)
    said(probe, "not ready: /imu/data: not heard from /probe, since the reliability differs: expected reliable")
    # by which the launcher knows the lines of the log
    assert all(words in process.stderr for words in (f"[state_estimator]{WAITS}", f"[state_estimator]: {NOT_READY}"))


def test_motor_states_are_heard_with_best_effort_where_that_is_asked_for(bench: Bench) -> None:
    process = bench.start("state_estimator")
    probe = bench.probe()
    publisher = probe.node.create_publisher(JointState, MOTOR_STATES.name, qos_profile_sensor_data)
    said(probe, f"expected reliable, or in this node the parameter {OVERRIDE}.reliability")
    assert publisher.get_subscription_count() == 0
    process.close()
    bench.start("state_estimator", **{f"{OVERRIDE}.reliability": "best_effort"})
    probe.wait_for(lambda: publisher.get_subscription_count() > 0, "motor_states are heard")


@pytest.mark.parametrize(
    ("policy", "value", "expected"),
    [("reliability", "banana", "`banana`"), ("depth", -4, "expected 1 to 100000"), ("depth", "x", "expecting type")],
)
def test_an_override_that_is_none_ends_the_node(bench: Bench, policy: str, value: object, expected: str) -> None:
    process = bench.start("state_estimator", **{f"{OVERRIDE}.{policy}": value})
    assert process.wait() == 2
    assert process.stderr.startswith("state_estimator: qos_overrides of motor_states: ")
    assert expected in process.stderr
    assert len(process.stderr.splitlines()) == 1
