# SPDX-License-Identifier: Apache-2.0
"""The law that keeps to the path makes motions on request: whole graphs in lockstep, to the last bit."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bag_contents import contents
from fivebar_command import FivebarCommand

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.scenario import Scenario
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.loop.plan_sample import references_along
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import Platform
from fivebar_control.planning.order_planning import plan_order
from fivebar_control.planning.orders import PlanningRequest
from fivebar_control.scenario.goal_conditions import conditions_of
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_description.interface import (
    GOAL_STATUS,
    JOINT_STATES,
    JOINTS,
    REFERENCE,
    TORQUE_COMMAND,
    torque_topic,
)

PATH_TORQUE = torque_topic("path")

PUSHED = """\
name: pushed
scenario:
  controller: path
  judge: path
  loads: {push: 1.0, push_length: 0.1}
  plant: {mass_scale: 0.97, torque_limit: 2.0, push: {force: 1.0, heading: 1.5708, start: 1.1, length: 0.1}}
start: [0.0, 0.15]
steps:
  - {move: [0.0, 0.12]}
  - {move: [0.0, 0.03], mode: "-"}
"""
"""The push meets the requested motion, along its path."""


@pytest.mark.extra
def test_a_program_follows_the_path_of_each_move(fivebar: Callable[..., FivebarCommand], tmp_path: Path) -> None:
    file, out = tmp_path / "pushed.yaml", tmp_path / "out"
    file.write_text(PUSHED, encoding="utf-8")
    command = fivebar("program", str(file), "--json", "--no-page", "--out", str(out))
    assert command.finish() == 0, command.stderr
    summary = command.json()["summary"]
    assert summary["outcome"] == "succeeded"
    assert summary["assembly_mode_changes"] == summary["planned_mode_changes"] == 1
    # the law leaves the timing to the push, and keeps to the path
    assert summary["tracking_error_peak_m"] > 2e-3
    assert summary["path_error_peak_m"] < 0.2e-3
    assert summary["within_tolerance"]

    run = RunDirectory(out)
    scenario, recording = run.read_scenario(), read_bag(run.bag)
    (moving,) = (one for one in map(json.loads, recording.texts(GOAL_STATUS)) if one["state"] == "moving")
    torques = torques_again(scenario, recording, moving)
    assert np.array_equal(torques, recording.field(PATH_TORQUE, "effort"))


def torques_again(scenario: Scenario, recording: Recording, moving: Mapping[str, Any]) -> np.ndarray:
    """Return the law's torques (Nm) for the recorded states, by the plan and by the motion that was requested."""
    robot, plan = scenario.five_bar(), scenario.plan()
    law = LawRunner(tuned_controller(scenario).nominal, robot, plan, scenario.rate_hz)
    start, goal = (tuple(point) for point in moving["waypoints"])
    planned = plan_order(conditions_of(scenario), PlanningRequest(start, scenario.working_mode, goal, -1, 0.0))
    assert list(planned.durations) == moving["durations_s"]
    whole = np.array(references_along(planned.path(), scenario.rate_hz))
    names = recording.joint_names(JOINT_STATES)
    order = [names.index(joint) for joint in JOINTS]
    joints = np.hstack([recording.field(JOINT_STATES, field)[:, order] for field in ("position", "velocity")])
    places, speeds = (recording.field(REFERENCE, field) for field in ("position", "velocity"))
    found = []
    for sample, (measured, place, speed) in enumerate(zip(joints, places, speeds, strict=False)):
        if sample == moving["first_sample"]:
            law.follow(whole)
        desired = Platform(*place.tolist(), *speed[2:].tolist())
        reference = reference_from_platform(robot, scenario.working_mode, desired)
        found.append(law(sample, state_from_joints(robot, *measured.tolist()), reference))
    return np.array(found)


@pytest.mark.extra
def test_a_goto_is_equal_with_nodes_and_without(fivebar: Callable[..., FivebarCommand], tmp_path: Path) -> None:
    bags = []
    for how in ("--ros", "--offline"):
        out = tmp_path / how.strip("-")
        command = fivebar("goto", "0", "0.03", "--mode=-", "--controller", "path", how, "--json", "--out", str(out))
        assert command.finish() == 0, command.stderr
        summary = command.json()["summary"]
        assert summary["outcome"] == "succeeded"
        assert summary["assembly_mode_changes"] == 1
        bags.append(read_bag(out / "bag"))
    ros, offline = bags
    for topic in (JOINT_STATES, REFERENCE, PATH_TORQUE, TORQUE_COMMAND):
        assert contents(ros, topic) == contents(offline, topic), topic.name
        assert len(contents(ros, topic)) > 200
