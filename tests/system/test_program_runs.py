"""`fivebar program`: carried out by the node graph, refused before anything moves, and on the topic of a robot that
stands."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import pytest
from fivebar_command import FivebarCommand

from fivebar_bringup.runs.bag.reader import read_bag
from fivebar_description.interface import GOAL_STATUS, PAYLOAD, PROGRAM_STATUS, output_topic

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


def test_it_works_through_the_locus_and_back(fivebar: Callable[..., FivebarCommand], tmp_path: Path) -> None:
    file, out = tmp_path / "short.yaml", tmp_path / "out"
    file.write_text(WORK, encoding="utf-8")
    command = fivebar("program", str(file), "--json", "--no-page", "--out", str(out))
    assert command.finish() == 0, command.stderr
    printed = command.json()
    assert printed["program"] == {
        **{"state": "completed", "program": "short", "step": "7", "line": 10, "rounds": [], "done": 7, "of": 7},
        "action": {"SetOutput": {"pin": "gripper", "on": False}},
    }
    summary = printed["summary"]
    assert summary["completed"] and summary["within_tolerance"]
    assert summary["assembly_mode_changes"] == summary["planned_mode_changes"] == 2
    assert summary["samples"] == summary["planned_samples"]
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


@pytest.mark.parametrize(
    ("step", "reason"),
    [
        ("move: [0.0, 0.5]", "short.yaml: step 8 (line 11): goal: "),
        ("jump: 1", "short.yaml: steps.7: {'jump': 1}: expected one of move, dwell"),
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
