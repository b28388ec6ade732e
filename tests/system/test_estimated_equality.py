# SPDX-License-Identifier: Apache-2.0
"""A run of the node graph with the estimator, and one without ROS, leave the same figures to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np
import pytest
from bag_contents import contents
from fivebar_command import FivebarCommand

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import (
    ESTIMATION_TOPICS,
    EXTRA_READINGS,
    GROUND_TRUTH,
    IMU_DATA,
    IMU_ERROR,
    JOINT_STATES,
    PASSIVE_STATES,
    TOPICS,
    UNIFIED_TORQUE,
    VISION_TOPICS,
    Topic,
    late_stamp_ns,
)
from fivebar_sim.sensors import lost_readings

pytestmark = pytest.mark.extra

ENCODERS = """
waypoints: [[0.0, 0.15], [0.0, 0.02]]
segment_duration: 0.5
gains: {kp: 1600.0, kd: 80.0, kp_vhc: 1600.0, kd_vhc: 80.0}
plant: {torque_quantum: 0.002, encoder_counts: 20000, delay_samples: 2}
estimator: ekf
"""
GYROSCOPE = """
waypoints: [[0.0, 0.15], [0.0, 0.02]]
segment_duration: 0.5
gains: {kp: 1600.0, kd: 80.0, kp_vhc: 1600.0, kd_vhc: 80.0}
plant: {torque_quantum: 0.002, encoder_counts: 20000, delay_samples: 2}
imu: {noise: 0.05, gyro_noise: 0.01, gyro_bias: 0.02, rate_hz: 100, latency: 0.004, lost: 0.05, roll: 0.2, yaw: -1.0,
      clock_offset: 0.005, gyro_bandwidth_hz: 80.0}
sensors: {passive_encoder: {leg: 1, zero: 0.002, eccentricity: 0.0005, rate_hz: 250, latency: 0.006, lost: 0.05}}
estimator: ekf
ekf: {gyro: true, gyro_clock: 0.005}
tolerances: {length: 0.0003, zero: 0.001}
"""
"""Slow, late, lossy, filtered, mounted askew and stamped by another clock; with a late encoder on a passive joint."""

SAMPLES, DELAY, RATE_HZ = 251, 2, 500
IMU_OF = {ENCODERS: ImuSettings(), GYROSCOPE: ImuSettings(rate_hz=100, latency=0.004, lost=0.05, clock_offset=0.005)}
OTHERS = (UNIFIED_TORQUE, PASSIVE_STATES, EXTRA_READINGS, *VISION_TOPICS)
STAMPED = [topic for topic in TOPICS if topic.type == "sensor_msgs/msg/JointState" and topic not in OTHERS]


class Bags(NamedTuple):
    """The bag of the graph's run, that of the offline run, and the scenario."""

    ros: Recording
    offline: Recording
    scenario: str


@pytest.fixture(scope="module", params=[ENCODERS, GYROSCOPE], ids=["encoders", "gyroscope"])
def bags(
    request: pytest.FixtureRequest,
    fivebar: Callable[..., FivebarCommand],
    folder: Path,
) -> Bags:
    name = f"short_{request.param_index}"
    scenario = folder / f"{name}.yaml"
    scenario.write_text(f"name: {name}\n{request.param}", encoding="utf-8")
    found = []
    for command in ("run", "simulate"):
        out = folder / f"{name}_{command}"
        call = fivebar(command, str(scenario), "--json", "--out", str(out))
        assert call.finish() == 0, call.stderr
        assert call.json()["outcome"] == "succeeded"
        assert 0.0 < call.json()["estimate_error_max_m"] < 5e-4
        found.append(read_bag(out / "bag"))
    return Bags(found[0], found[1], request.param)


def test_the_estimators_topics_are_among_them() -> None:
    assert {JOINT_STATES, GROUND_TRUTH, *ESTIMATION_TOPICS} < set(STAMPED)


@pytest.mark.parametrize("topic", STAMPED, ids=lambda topic: topic.name)
def test_every_stamped_message_is_equal(bags: Bags, topic: Topic) -> None:
    assert contents(bags.ros, topic) == contents(bags.offline, topic)
    assert len(contents(bags.ros, topic)) >= SAMPLES
    assert bags.ros.joint_names(topic) == bags.offline.joint_names(topic)


def made(scenario: str) -> list[int]:
    """Return the samples of the IMU's readings that arrive before the run's end."""
    imu = IMU_OF[scenario]
    every, latency = imu.schedule(RATE_HZ)
    lost = lost_readings(imu, 0, SAMPLES)
    return [sample for sample in range(0, SAMPLES - latency, every) if not lost[sample]]


def test_the_readings_of_the_imu_are_equal(bags: Bags) -> None:
    readings = [contents(bag, IMU_DATA, ("linear_acceleration",)) for bag in (bags.ros, bags.offline)]
    assert readings[0] == readings[1]
    offset = IMU_OF[bags.scenario].clock_offset
    stamps = [late_stamp_ns(sample, RATE_HZ, offset) for sample in made(bags.scenario)]
    assert [stamp for stamp, _ in readings[0]] == stamps


def test_the_readings_of_the_passive_joint_are_equal(bags: Bags) -> None:
    if bags.scenario == ENCODERS:
        assert [bag.count(PASSIVE_STATES) for bag in (bags.ros, bags.offline)] == [0, 0]
        return
    readings = [contents(bag, PASSIVE_STATES, ("position",)) for bag in (bags.ros, bags.offline)]
    assert readings[0] == readings[1]
    assert len(readings[0]) > 100


def test_the_imu_is_compared_with_the_reference_of_its_own_moment(bags: Bags) -> None:
    """Which for the first samples nobody has published: the reference is that of two samples later."""
    # by a clock of its own it is not: no reference has its stamps
    offset = IMU_OF[bags.scenario].clock_offset
    compared = sum(sample >= DELAY for sample in made(bags.scenario)) if offset == 0.0 else 0
    for bag in bags[:2]:
        errors = bag.field(IMU_ERROR, "data")
        # sample 0 and its answer may come again until the plant has heard of it
        assert errors.size >= compared
        assert np.array_equal(errors[errors.size - compared :], bags.offline.field(IMU_ERROR, "data"))
