# SPDX-License-Identifier: Apache-2.0
"""`fivebar program`: carried out by the node graph, refused before anything moves, and on the topic of a robot that
stands."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from fivebar_command import FivebarCommand

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.report.requests import plan_with_requests
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.interface import (
    GOAL_STATUS,
    JOINT_STATES,
    JOINTS,
    PAYLOAD,
    PROGRAM_STATUS,
    REFERENCE,
    output_topic,
)
from fivebar_studies.estimate.estimate import estimate_bag

WORK = """\
name: short
start: [0.0, 0.15]
steps:
  - {move: [0.0, 0.12], duration: 0.2}
  - {move: [0.0, 0.03], mode: "-", duration: 0.5}
  - set: gripper
  - pick: 0.1
  - dwell: 0.05
  - {move: [0.0, 0.12], mode: "+", duration: 0.5}
  - reset: gripper
"""


@pytest.mark.extra
def test_it_works_through_the_locus_and_back(fivebar: Callable[..., FivebarCommand], tmp_path: Path) -> None:
    file, out = tmp_path / "short.yaml", tmp_path / "out"
    file.write_text(WORK, encoding="utf-8")
    command = fivebar("program", str(file), "--json", "--no-page", "--out", str(out))
    assert command.finish() == 0, command.stderr
    printed = command.json()
    assert printed["program"].pop("pid") > 1
    assert printed["program"] == {
        **{"state": "completed", "program": "short", "step": "7", "line": 10, "rounds": [], "done": 7, "of": 7},
        "action": {"SetOutput": {"pin": "gripper", "on": False}},
    }
    summary = printed["summary"]
    assert summary["outcome"] == "succeeded"
    assert summary["assembly_mode_changes"] == summary["planned_mode_changes"] == 2
    assert summary["samples"] == summary["planned_samples"]
    # moves, dwell and pick take 1.35 s; each sample waits for a plan, without which thousands would pass meanwhile
    assert 1.35 < summary["samples"] / 500 < 3.0
    recording = read_bag(out / "bag")
    states = [json.loads(text) for text in recording.texts(GOAL_STATUS)]
    # the first move is the plan of the run
    assert [state["state"] for state in states] == ["planning", "moving", "arrived"] * 2
    assert [state["durations_s"] for state in states if state["state"] == "moving"] == [[0.5], [0.5]]
    assert recording.count(output_topic("gripper")) == 2
    assert recording.count(PAYLOAD) == 1
    told = [json.loads(text) for text in recording.texts(PROGRAM_STATUS)]
    assert [state["done"] for state in told] == sorted(state["done"] for state in told)
    assert (out / "program.yaml").read_text(encoding="utf-8") == WORK


ESTIMATED = """\
name: estimated
scenario:
  {rate_hz: 250, estimator: ekf, ekf: {gyro: true}, plant: {encoder_counts: 20000, delay_samples: 1}}
steps:
  - move: [0.0, 0.02]
  - pick: 0.3
  - {move: [0.0, 0.15], mode: "+"}
  - place: 0.3
"""


LOADED = """\
name: loaded
scenario: {loads: {push: 1.0}}
start: [0.0, 0.15]
steps:
  - {move: [0.0, 0.12], duration: 0.2}
  - {move: [0.0, 0.03], mode: "-", duration: 0.5}
  - pick: 0.1
  - {move: [0.0, 0.12], mode: "+"}
"""


@pytest.mark.extra
def test_each_move_has_its_odds_where_the_robot_declares_something(
    fivebar: Callable[..., FivebarCommand], tmp_path: Path
) -> None:
    """Before anything moves, and told again by the graph, whose planner finds the same in a process of its own."""
    file, out = tmp_path / "loaded.yaml", tmp_path / "out"
    file.write_text(LOADED, encoding="utf-8")
    command = fivebar("program", str(file), "--json", "--no-page", "--out", str(out))
    assert command.finish() == 0, command.stderr
    printed = command.json()
    moves = [step["odds"] for step in printed["steps"] if step["waypoints"]]
    assert [one["robots"] for one in moves] == [24, 24, 24]
    assert all(one["share"] >= 0.9 for one in moves)
    summary = printed["summary"]
    assert summary["odds"] == printed["odds"]
    assert 0.9 <= summary["odds"]["share"] <= 1.0
    # the first move is the plan of the run
    assert [one["odds"] for one in summary["requested_odds"]] == moves[1:]
    assert [one["goal"] for one in summary["requested_odds"]] == [[0.0, 0.03], [0.0, 0.12]]


@pytest.mark.extra
def test_a_program_that_requests_no_further_motion_rests_until_it_is_over(
    fivebar: Callable[..., FivebarCommand], tmp_path: Path
) -> None:
    file = tmp_path / "rest.yaml"
    file.write_text("name: rest\nsteps: [{move: [0.02, 0.13]}, {dwell: 0.1}]\n", encoding="utf-8")
    command = fivebar("program", str(file), "--json", "--no-page", "--out", str(tmp_path / "out"))
    assert command.finish() == 0, command.stderr
    summary = command.json()["summary"]
    assert summary["outcome"] == "succeeded"
    # the move takes 0.34 s, the dwell and what it takes to settle come on top
    assert summary["samples"] == summary["planned_samples"] > 0.44 * 500


@pytest.mark.extra
def test_its_estimate_can_be_had_again_with_the_payloads(
    fivebar: Callable[..., FivebarCommand], tmp_path: Path
) -> None:
    file, out = tmp_path / "estimated.yaml", tmp_path / "out"
    file.write_text(ESTIMATED, encoding="utf-8")
    command = fivebar("program", str(file), "--no-page", "--out", str(out))
    assert command.finish() == 0, command.stderr
    assert read_bag(out / "bag").count(PAYLOAD) == 2
    again = estimate_bag(out, None, ()).after
    assert again.same
    assert again.fault == ""


@pytest.mark.parametrize(
    ("step", "reason"),
    [
        ("move: [0.0, 0.5]", "short.yaml: step 8 (line 11): goal: "),
        ("jump: 1", "short.yaml: steps.7: {'jump': 1}: expected one of move, follow"),
    ],
)
def test_nothing_moves_where_a_step_cannot_be(
    step: str, reason: str, fivebar: Callable[..., FivebarCommand], tmp_path: Path
) -> None:
    file, out = tmp_path / "short.yaml", tmp_path / "out"
    file.write_text(f"{WORK}  - {step}\n", encoding="utf-8")
    command = fivebar("program", str(file), "--out", str(out))
    assert command.finish() == 2
    assert reason in command.stderr
    assert command.stderr.count("\n") == 1
    assert not out.exists()


OVER_PARTS, OVER_BIN, RADIUS = (0.03, 0.14), (0.0, 0.14), 0.01
"""Where the rectangle of `ROUND` has its corners, and within what they are rounded (m)."""

ROUND = f"""\
name: round
start: [0.03, 0.12]
steps:
  - {{move: [0.0, 0.02], mode: "-", via: [{[*OVER_PARTS]}, {[*OVER_BIN]}], blend_radius: {RADIUS}}}
  - pick: 0.1
  - {{move: [0.03, 0.12], mode: "+", via: [{[*OVER_BIN]}, {[*OVER_PARTS]}], blend_radius: {RADIUS}}}
"""


@pytest.mark.extra
def test_it_goes_round_via_points_without_a_rest_through_the_locus_and_back(
    fivebar: Callable[..., FivebarCommand], tmp_path: Path
) -> None:
    """As the plan of the run, which every node makes, and as a request, with a payload."""
    file, with_rests, out = tmp_path / "round.yaml", tmp_path / "rests.yaml", tmp_path / "out"
    file.write_text(ROUND, encoding="utf-8")
    with_rests.write_text(ROUND.replace(f"blend_radius: {RADIUS}", "blend_radius: 0"), encoding="utf-8")
    command = fivebar("program", str(file), "--json", "--no-page", "--out", str(out))
    assert command.finish() == 0, command.stderr
    printed = command.json()
    summary, steps = printed["summary"], printed["steps"]
    assert printed["program"]["state"] == "completed"
    assert summary["assembly_mode_changes"] == summary["planned_mode_changes"] == 2
    assert summary["tracking_error_peak_m"] < 0.3e-3
    assert [step["blend_radius"] for step in steps] == [[RADIUS] * 2, [], [RADIUS] * 2]
    rests = fivebar("program", str(with_rests), "--json", "--dry-run")
    assert rests.finish() == 0, rests.stderr
    assert sum(step["duration_s"] for step in steps) < 0.85 * sum(step["duration_s"] for step in rests.json()["steps"])

    run = RunDirectory(out)
    scenario, recording = run.read_scenario(), read_bag(run.bag)
    names = recording.joint_names(JOINT_STATES)
    order = [names.index(joint) for joint in JOINTS]
    seen = np.hstack([recording.field(JOINT_STATES, field)[:, order] for field in ("position", "velocity")])
    states = [state_from_joints(scenario.five_bar(), *row) for row in seen.tolist()]
    for corner in (OVER_PARTS, OVER_BIN):
        near = [np.hypot(one.vx, one.vy) for one in states if np.hypot(one.x - corner[0], one.y - corner[1]) < RADIUS]
        # there and back
        assert len(near) > 50
        assert min(near) > 0.04
    # the report plans the request again as it was planned, for what the platform carried
    plan, numbers = plan_with_requests(recording, scenario), recording.samples(REFERENCE, scenario.rate_hz)
    planned = np.array([plan.path.at(number / scenario.rate_hz)[:4] for number in numbers.tolist()])
    assert recording.field(REFERENCE, "position") == pytest.approx(planned, abs=1e-12)
    (moving,) = (one for one in map(json.loads, recording.texts(GOAL_STATUS)) if one["state"] == "moving")
    assert (moving["blend_radius"], moving["time_law"], moving["payload_kg"]) == ([RADIUS] * 2, "optimal", 0.1)
