# SPDX-License-Identifier: Apache-2.0
"""Two runs of the node graph, and a run without ROS, leave the same figures to the last bit."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_contents import JOINT_STATE_FIELDS, contents
from fivebar_command import FivebarCommand, InstalledCommand

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_description.interface import (
    DRIVES_STATE,
    ESTIMATION_TOPICS,
    EXTRA_READINGS,
    GROUND_TRUTH,
    IMU_DATA,
    IMU_ERROR,
    JOINT_STATES,
    PASSIVE_STATES,
    REFERENCE,
    SAFETY_STATE,
    SCENE,
    SCENE_MAP,
    START_STAMP_NS,
    SUPERVISOR_SIGMA,
    TOPICS,
    TORQUE_COMMAND,
    TORQUE_REQUESTED,
    UNIFIED_TORQUE,
    VISION_TOPICS,
    Topic,
)

SCENARIO = "name: short\nwaypoints: [[0.0, 0.15], [0.0, 0.02], [0.0, 0.15]]\nsegment_duration: 0.5\nforce: true\n"
SAMPLES = 501
PERIOD_NS = 2_000_000

STAMPED = [
    topic
    for topic in TOPICS
    if topic.type in ("sensor_msgs/msg/JointState", "sensor_msgs/msg/Imu")
    and topic not in (*ESTIMATION_TOPICS, EXTRA_READINGS, GROUND_TRUTH, PASSIVE_STATES, UNIFIED_TORQUE, *VISION_TOPICS)
]
IMU_FIELDS = ("linear_acceleration", "angular_velocity", "orientation")

TIMING = ("wall_s", "cycle_time_ms", "latency_ms", "overruns", "runner", "mode")
"""Figures of a summary that are no property of the motion."""


class Runs:
    """The same scenario run with nodes, with nodes by the installed command, and without."""

    def __init__(self, fivebar: Callable[..., FivebarCommand], folder: Path) -> None:
        scenario = folder / "short.yaml"
        scenario.write_text(SCENARIO, encoding="utf-8")
        self.summaries: dict[str, Any] = {}
        self.bags: dict[str, Recording] = {}
        for name, start, command in (
            # pictures of a run change nothing in it
            ("ros", fivebar, ("run", "--scene")),
            ("ros installed", partial(InstalledCommand, folder / "installed"), ("run",)),
            ("offline", fivebar, ("simulate",)),
        ):
            out = folder / name.replace(" ", "_")
            call = start(*command, str(scenario), "--json", "--out", str(out))
            assert call.finish() == 0, call.stderr
            assert call.stderr == ""
            self.summaries[name] = call.json()
            self.bags[name] = read_bag(out / "bag")
            call.expect_no_process(0.0)


@pytest.fixture(scope="module")
def runs(fivebar: Callable[..., FivebarCommand], folder: Path) -> Runs:
    return Runs(fivebar, folder)


def test_the_run_succeeds(runs: Runs) -> None:
    for name, summary in runs.summaries.items():
        assert summary["outcome"] == "succeeded", (name, summary["not_completed_because"])
        assert summary["samples"] == SAMPLES
        assert summary["assembly_mode_changes"] == 2
        assert summary["faults"] == []
        assert summary["dropped_messages"] == 0
        assert max(summary["torque_peak_nm"]) < 10.0


def test_pictures_are_recorded_where_they_are_asked_for(runs: Runs) -> None:
    assert runs.bags["ros"].count(SCENE) > 0
    assert runs.bags["ros"].count(SCENE_MAP) == 1
    assert runs.bags["ros installed"].count(SCENE) == 0


def test_there_are_stamped_topics() -> None:
    assert {JOINT_STATES, REFERENCE, IMU_DATA, TORQUE_COMMAND, TORQUE_REQUESTED} < set(STAMPED)


@pytest.mark.parametrize("other", ["ros installed", "offline"])
@pytest.mark.parametrize("topic", STAMPED, ids=lambda topic: topic.name)
def test_every_stamped_message_is_equal(runs: Runs, topic: Topic, other: str) -> None:
    first, second = runs.bags["ros"], runs.bags[other]
    fields = IMU_FIELDS if topic is IMU_DATA else JOINT_STATE_FIELDS
    found, wanted = (contents(bag, topic, fields) for bag in (first, second))
    assert found == wanted
    assert len(found) >= SAMPLES
    if topic is not IMU_DATA:
        assert first.joint_names(topic) == second.joint_names(topic)


@pytest.mark.parametrize("name", ["ros", "offline"])
def test_messages_are_logged_at_the_times_of_their_samples(runs: Runs, name: str) -> None:
    """So `ros2 bag play --clock` tells the time that the messages have, in both."""
    bag = runs.bags[name]
    for topic in STAMPED:
        if topic is not IMU_DATA:
            np.testing.assert_array_equal(bag.log_times(topic), bag.stamps(topic), topic.name)
    last = bag.log_times(REFERENCE)[-1]
    for topic in (IMU_DATA, IMU_ERROR, SUPERVISOR_SIGMA, SAFETY_STATE, DRIVES_STATE):
        times = bag.log_times(topic)
        assert np.all(np.diff(times) >= 0)
        assert START_STAMP_NS <= times[0] <= times[-1] <= last
    # as they come with the measurement, or while the next sample is on its way already
    assert np.all(np.isin(bag.log_times(IMU_DATA) - bag.stamps(IMU_DATA), (0, PERIOD_NS)))


@pytest.mark.parametrize("other", ["ros installed", "offline"])
def test_every_figure_of_the_summary_is_equal(runs: Runs, other: str) -> None:
    first, second = dict(runs.summaries["ros"]), dict(runs.summaries[other])
    for name in TIMING:
        first.pop(name), second.pop(name)
    assert first == second
