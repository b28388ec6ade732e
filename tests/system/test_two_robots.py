# SPDX-License-Identifier: Apache-2.0
"""Two robots in one domain, each in its namespace: both run, are recorded and reported, and do not hear each other."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from fivebar_command import FivebarCommand
from rosbags.rosbag2 import Reader

from fivebar_bringup.bag.definitions import TYPESTORE, absolute_name
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.report.report import write_report
from fivebar_bringup.runs.description import described_robot
from fivebar_bringup.runs.domain import private_domain
from fivebar_description.interface import (
    BASE_FRAME,
    DIAGNOSTICS,
    GOAL,
    GOAL_STATUS,
    IMU_FRAME,
    JOINT_STATES,
    RUN_READY,
    frame_prefix,
)

SCENARIO = "name: short\nwaypoints: [[0.0, 0.15], [0.0, {y}]]\nsegment_duration: 0.2\nforce: true\n"
SAMPLES = 101

STAMPED = ("sensor_msgs/msg/JointState", "sensor_msgs/msg/Imu")


def frames_of(bag: Path) -> set[str]:
    """Return the frames of all recorded messages that have one."""
    with Reader(bag) as reader:
        stamped = [one for one in reader.connections if one.msgtype in STAMPED]
        messages = (TYPESTORE.deserialize_cdr(data, one.msgtype) for one, _, data in reader.messages(stamped))
        return {message.header.frame_id for message in messages}


@pytest.mark.extra
def test_two_robots_run_in_one_domain(tmp_path: Path) -> None:
    calls: dict[str, FivebarCommand] = {}
    with private_domain() as domain:
        for name, y in (("robot1", 0.14), ("robot2", 0.13)):
            scenario = tmp_path / f"{name}.yaml"
            scenario.write_text(SCENARIO.format(y=y), encoding="utf-8")
            calls[name] = FivebarCommand(
                tmp_path / name,
                *("run", str(scenario), "--json", "--out", str(tmp_path / name / "out")),
                *("--domain", str(domain), "--namespace", name),
                domain=domain,
            )
        try:
            for call in calls.values():
                assert call.finish() == 0, call.stdout + call.stderr
                assert call.json()["samples"] == SAMPLES
        finally:
            for call in calls.values():
                call.close()
    heights = []
    for name in calls:
        bag = read_bag(tmp_path / name / "out" / "bag")
        assert {topic.split("/")[1] for topic in bag.topics} == {name, "diagnostics"}
        assert bag.count(DIAGNOSTICS) > 0
        assert {absolute_name(GOAL, name), absolute_name(GOAL_STATUS, name)} <= set(bag.topics)
        assert len(set(bag.texts(RUN_READY))) == len(bag.texts(RUN_READY))
        assert write_report(RunDirectory(tmp_path / name / "out"), with_page=False).outcome == "succeeded"
        frames = frames_of(tmp_path / name / "out" / "bag")
        assert frames == {f"{name}/{BASE_FRAME}", f"{name}/{IMU_FRAME}"}
        # robot_state_publisher puts the same name before the frames of the URDF
        links = {link.get("name") for link in ElementTree.fromstring(described_robot()).iter("link")}
        assert frames <= {f"{frame_prefix(name)}{link}" for link in links}
        heights.append(bag.field(JOINT_STATES, "position")[-1])
    assert not np.allclose(heights[0], heights[1], atol=1e-3)


def test_a_name_that_ros_does_not_take_is_refused(fivebar: Callable[..., FivebarCommand]) -> None:
    refused = fivebar("run", "middle", "--namespace", "robot 1")
    assert refused.finish() == 2
    assert "--namespace: 'robot 1': expected letters" in refused.stderr
