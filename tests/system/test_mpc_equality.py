# SPDX-License-Identifier: Apache-2.0
"""The predictive law and the path law as a node graph and without ROS, to the last bit, from an estimate."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest
from bag_contents import contents
from fivebar_command import FivebarCommand

from fivebar_bringup.bag.reader import read_bag
from fivebar_description.interface import JOINT_STATES, REFERENCE, TORQUE_COMMAND, torque_topic

ROUND_A_CORNER = """
name: short_mpc
controller: mpc
waypoints: [[0.0, 0.15], [0.02, 0.11], [0.0, 0.02]]
segment_duration: [0.15, 0.25]
time_law: optimal
blend_radius: 0.02
estimator: ekf
plant: {encoder_counts: 20000, delay_samples: 1, friction_scale: 1.3, mass_scale: 0.9, torque_limit: 2.0}
safety: {torque_rate_limit: 60.0}
law: {horizon: 20}
"""
PUSHED = """
name: short_path
controller: path
waypoints: [[0.0, 0.15], [0.0, 0.06]]
segment_duration: 0.4
estimator: ekf
ekf: {gyro: true}
imu: {rate_hz: 250, latency: 0.004}
unified: {kp: 2500.0, kd: 100.0, weight: 0.3}
error_tolerance: 0.01
plant:
  {encoder_counts: 20000, delay_samples: 1, mass_scale: 0.95, torque_limit: 2.0, push: {force: 1.0, start: 0.1}}
"""
SAMPLES = 201


# a process for each of eight nodes, for what the nodes' own tests and those of the law cover in parts
@pytest.mark.extra
@pytest.mark.parametrize(("law", "content"), [("mpc", ROUND_A_CORNER), ("path", PUSHED)])
def test_every_stamped_message_is_equal(
    fivebar: Callable[..., FivebarCommand], folder: Path, law: str, content: str
) -> None:
    scenario = folder / f"short_{law}.yaml"
    scenario.write_text(content, encoding="utf-8")
    bags = []
    for command in ("run", "simulate"):
        out = folder / f"{law}_{command}"
        call = fivebar(command, str(scenario), "--json", "--out", str(out))
        assert call.finish() == 0, call.stderr
        summary = call.json()
        assert summary["outcome"] == "succeeded", summary["not_completed_because"]
        assert summary["assembly_mode_changes"] == 1
        bags.append(read_bag(out / "bag"))
    ros, offline = bags
    for topic in (JOINT_STATES, REFERENCE, torque_topic(law), TORQUE_COMMAND):
        assert contents(ros, topic) == contents(offline, topic), topic.name
        assert len(contents(ros, topic)) >= SAMPLES
