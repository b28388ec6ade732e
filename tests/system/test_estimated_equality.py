"""A run of the node graph with the estimator, and one without ROS, leave the same figures to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bag_contents import contents
from fivebar_command import FivebarCommand, ForkedCommand

from fivebar_bringup.runs.bag.reader import read_bag
from fivebar_bringup.runs.bag.recording import Recording
from fivebar_description.interface import ESTIMATION_TOPICS, IMU_ERROR, JOINT_STATES, TOPICS, UNIFIED_TORQUE, Topic

SCENARIO = """
name: short_encoders
waypoints: [[0.0, 0.15], [0.0, 0.02]]
segment_duration: 0.5
gains: {kp: 1600.0, kd: 80.0, kp_vhc: 1600.0, kd_vhc: 80.0}
plant: {torque_quantum: 0.002, encoder_counts: 20000, delay_samples: 2}
estimator: ekf
"""
SAMPLES, DELAY = 251, 2
STAMPED = [topic for topic in TOPICS if topic.type == "sensor_msgs/msg/JointState" and topic != UNIFIED_TORQUE]


@pytest.fixture(scope="module")
def bags(
    fivebar: Callable[..., FivebarCommand], forked: Callable[..., ForkedCommand], folder: Path
) -> tuple[Recording, Recording]:
    scenario = folder / "short_encoders.yaml"
    scenario.write_text(SCENARIO, encoding="utf-8")
    bags = []
    for start, command in ((fivebar, "run"), (forked, "simulate")):
        out = folder / f"estimated_{command}"
        call = start(command, str(scenario), "--json", "--out", str(out))
        assert call.finish() == 0, call.stderr
        assert call.json()["completed"] is True
        assert 0.0 < call.json()["estimate_error_max_m"] < 5e-4
        bags.append(read_bag(out / "bag"))
    return bags[0], bags[1]


def test_the_estimators_topics_are_among_them() -> None:
    assert {JOINT_STATES, *ESTIMATION_TOPICS} < set(STAMPED)


@pytest.mark.parametrize("topic", STAMPED, ids=lambda topic: topic.name)
def test_every_stamped_message_is_equal(bags: tuple[Recording, Recording], topic: Topic) -> None:
    ros, offline = bags
    assert contents(ros, topic) == contents(offline, topic)
    assert len(contents(ros, topic)) >= SAMPLES
    assert ros.joint_names(topic) == offline.joint_names(topic)


def test_the_imu_is_compared_with_the_reference_of_its_own_moment(bags: tuple[Recording, Recording]) -> None:
    """Which for the first samples nobody has published: the reference is that of two samples later."""
    for bag in bags:
        errors = bag.field(IMU_ERROR, "data")
        # sample 0 and its answer may come again until the plant has heard of it
        assert errors.size >= SAMPLES - DELAY
        assert np.array_equal(errors[-(SAMPLES - DELAY) :], bags[1].field(IMU_ERROR, "data"))
