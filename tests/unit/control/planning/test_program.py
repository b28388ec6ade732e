# SPDX-License-Identifier: Apache-2.0
"""Programs: read strictly, laid out in the order in which they are carried out, and handed out one by one."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fivebar_control.planning.motion_queue import read_goal
from fivebar_control.planning.program import (
    Carry,
    Move,
    SetOutput,
    Wait,
    goal_fields_of,
    load_program,
    read_program,
)
from fivebar_control.planning.program_run import SETTLING, ProgramRun, ProgramState
from fivebar_description.files import share_file
from fivebar_description.strict_yaml import InputError, yaml_text

SHIPPED = share_file("fivebar_bringup", "config", "programs")


def text_of(*steps: str) -> str:
    return "name: work\nsteps:\n" + "".join(f"  - {step}\n" for step in steps)


def actions_of(text: str) -> list[Any]:
    return [instruction.action for instruction in read_program(text, "work.yaml").instructions]


def test_steps_become_actions_that_know_what_came_before() -> None:
    text = text_of(
        "move: [0.0, 0.1]",
        "torque: 0.5",
        "speed: 0.8",
        "{move: [0.0, 0.02], mode: '-', duration: 1}",
        "pick: 0.1",
        "pick: 0.2",
        "place: 0.3",
        "set: gripper",
        "reset: gripper",
        "dwell: 2",
        "{move: [0.0, 0.1], mode: '+', via: [[0.01, 0.02], [0.02, 0.03]]}",
    )
    assert actions_of(text) == [
        Move(0.0, 0.1),
        Move(0.0, 0.02, -1, 1.0, 0.5, 0.8),
        Carry(0.1),
        Carry(pytest.approx(0.3)),
        Carry(0.0),
        SetOutput("gripper", True),
        SetOutput("gripper", False),
        Wait(2.0),
        Move(0.01, 0.02, 0, 0.0, 0.5, 0.8),
        Move(0.02, 0.03, 0, 0.0, 0.5, 0.8),
        Move(0.0, 0.1, 1, 0.0, 0.5, 0.8),
    ]


def test_a_move_round_corners_is_one_move_and_one_with_rests_a_move_each() -> None:
    via = ((0.01, 0.02), (0.02, 0.03))
    given = "via: [[0.01, 0.02], [0.02, 0.03]]"
    rests = actions_of(text_of(f"{{move: [0.0, 0.1], {given}, mode: '+'}}"))
    assert rests == [Move(0.01, 0.02), Move(0.02, 0.03), Move(0.0, 0.1, 1)]
    for nothing in ("0", "0.0", "[0, 0]"):
        assert actions_of(text_of(f"{{move: [0.0, 0.1], {given}, mode: '+', blend_radius: {nothing}}}")) == rests
    rounded = text_of(f"{{move: [0.0, 0.1], {given}, mode: '+', duration: 2, blend_radius: 0.01}}")
    assert actions_of(rounded) == [Move(0.0, 0.1, 1, 2.0, via=via, blend_radius=(0.01, 0.01))]
    mixed = actions_of(text_of(f"{{move: [0.0, 0.1], {given}, blend_radius: [0.01, 0]}}"))
    assert mixed == [Move(0.0, 0.1, via=via, blend_radius=(0.01, 0.0))]
    # and so it is requested
    fields = goal_fields_of(mixed[0])
    goal = read_goal(tuple(fields), tuple(fields.values()))
    assert (goal.x, goal.y, goal.via, goal.blend_radius) == (0.0, 0.1, via, (0.01, 0.0))
    assert set(goal_fields_of(rests[0])) == {"x", "y", "assembly_mode", "duration", "torque_share", "speed_share"}


def test_loops_are_written_out_and_every_round_knows_its_line() -> None:
    text = (
        "name: work\nsteps:\n- repeat: 2\n  steps:\n  - set: a\n  - repeat: 2\n    steps:\n    - dwell: 1\n- reset: a\n"
    )
    places = [instruction.place for instruction in read_program(text, "work.yaml").instructions]
    assert places == [
        "step 1.1 (line 5, round 1 of 2)",
        "step 1.2.1 (line 8, round 1 of 2, round 1 of 2)",
        "step 1.2.1 (line 8, round 1 of 2, round 2 of 2)",
        "step 1.1 (line 5, round 2 of 2)",
        "step 1.2.1 (line 8, round 2 of 2, round 1 of 2)",
        "step 1.2.1 (line 8, round 2 of 2, round 2 of 2)",
        "step 2 (line 9)",
    ]


def test_a_refused_step_is_not_reported_as_missing_too() -> None:
    long = "{move: [0, 0.02], duration: 1.0e+9}"
    said = "work.yaml: {}duration: 1000000000.0: expected at most 3600"
    for step, place in ((long, "steps.0."), (f"{{repeat: 2, steps: [{long}]}}", "steps.0.steps.0.")):
        with pytest.raises(InputError) as refused:
            read_program(text_of(step), "work.yaml")
        assert str(refused.value) == said.format(place)
    # too few are still too few, beside a mistake elsewhere
    with pytest.raises(InputError, match=r"name: 'a/b': .*; steps: \[\]: .* at least 1 item"):
        read_program("name: a/b\nsteps: []\n", "work.yaml")


@pytest.mark.parametrize("path", sorted(SHIPPED.glob("*.yaml")), ids=lambda path: path.stem)
def test_shipped_programs_cross_to_and_fro(path: Path) -> None:
    loaded = load_program(path)
    modes = [step.action.assembly for step in loaded.instructions if isinstance(step.action, Move)]
    assert modes.count(-1) >= 2
    assert modes.count(1) >= 2


REFUSED = {
    text_of("jump: 1"): "steps.0: {'jump': 1}: expected one of move, follow, dwell, set, reset",
    text_of("{move: [0, 0.1], dwell: 1}"): "torque, speed, repeat, found move, dwell",
    text_of("move: [0.0]"): "steps.0.move",
    text_of("move: [.nan, 0.1]"): "steps.0.move.0: nan: expected a finite number",
    text_of("{move: [0, 0.1], mode: 1}"): "steps.0.mode: 1",
    text_of("{move: [0, 0.1], speeed: 1}"): "steps.0.speeed: unknown key",
    text_of("{dwell: 1, mode: '+'}"): "mode: expected with move, not with dwell",
    text_of("{move: [0, 0.1], via: [[0, 0.12]], duration: 1}"): "duration: expected without via",
    text_of("{move: [0, 0.1], blend_radius: 0.01}"): "blend_radius: expected with via, whose corners are rounded",
    text_of("{dwell: 1, blend_radius: 0.01}"): "blend_radius: expected with move, not with dwell",
    text_of("{move: [0, 0.1], via: [[0, 0.12]], blend_radius: 1.0e-4}"): "expected 0 for a rest, or at least 0.001 m",
    text_of("{move: [0, 0.1], via: [[0, 0.12]], blend_radius: [0.01, 0.01]}"): "2 given: expected one number, or one",
    text_of("{move: [0, 0.1], via: [[0, 0.12]], blend_radius: .inf}"): "steps.0.blend_radius",
    text_of("{move: [0, 0.1], via: [[0, 0.12]], blend_radius: 0, duration: 1}"): "or with a blend_radius",
    text_of(f"{{move: [0, 0.1], via: {[[0, 0.12]] * 21}, blend_radius: 0.01}}"): "via: 21 points with a blend_radius",
    text_of("dwell: -1"): "steps.0.dwell: -1",
    text_of("dwell: yes"): "steps.0.dwell: 'yes'",
    text_of("dwell:"): "dwell: expected a value",
    text_of("set: ../etc"): "steps.0.set: '../etc'",
    text_of("torque: 1.5"): "steps.0.torque: 1.5",
    text_of("place: 0.1"): "line 3: step 1: place: 0.1 kg with 0 kg on the platform: expected a payload of 0 to",
    text_of("repeat: 2"): "repeat: expected steps to repeat",
    text_of("{repeat: 10000, steps: [{repeat: 10000, steps: [{dwell: 0}]}]}"): "100000000 with all rounds",
    text_of("3"): "steps.0: 3: expected a step such as",
    "name: work\nsteps: []\n": "steps",
    "name: a/b\nsteps: [{dwell: 1}]\n": "name: 'a/b'",
    "name: work\nsteps:\n- &a {dwell: 1}\n- *a\n": "line 4: *a: expected what it stands for, written out",
    "format: 2\nname: work\nactions: []\n": "format: 2: this release understands format 1; a newer release",
    "name: work\nsteps: [}\n": "is not valid YAML: line 2",
    "name: work\nsteps: " + "[" * 101: "is nested too deeply",
    "": "expected keys with values, found NoneType",
}  # fmt: skip


@pytest.mark.parametrize(("text", "reason"), REFUSED.items(), ids=list(REFUSED.values()))
def test_what_is_no_program_is_refused_in_one_line(text: str, reason: str) -> None:
    with pytest.raises(InputError) as refusal:
        read_program(text, "work.yaml")
    message = str(refusal.value)
    assert message.startswith("work.yaml: ")
    assert reason in message
    assert message.isprintable()


numbers = st.floats(0.01, 0.9, allow_nan=False)
places = st.lists(numbers, min_size=2, max_size=2)
plain = st.one_of(
    st.fixed_dictionaries({"move": places}, optional={"mode": st.sampled_from("+-"), "duration": numbers}),
    st.fixed_dictionaries({"move": places, "via": st.lists(places, min_size=1, max_size=3)}),
    st.fixed_dictionaries(
        {"move": places, "via": st.lists(places, min_size=1, max_size=3), "blend_radius": numbers},
        optional={"duration": numbers},
    ),
    st.sampled_from(("dwell", "pick", "torque", "speed")).flatmap(lambda key: st.fixed_dictionaries({key: numbers})),
    st.sampled_from(("set", "reset")).flatmap(lambda key: st.fixed_dictionaries({key: st.sampled_from(["a", "b_2"])})),
)
steps_of_programs = st.lists(
    st.recursive(
        plain,
        lambda inside: st.fixed_dictionaries(
            {"repeat": st.integers(1, 3), "steps": st.lists(inside, min_size=1, max_size=3)}
        ),
        max_leaves=8,
    ),
    min_size=1,
    max_size=4,
)


def carried_out(steps: list[dict[str, Any]]) -> int:
    """Count what a program does, without the module under test."""
    return sum(
        step["repeat"] * carried_out(step["steps"])
        if "repeat" in step
        else 0 if {"torque", "speed"} & set(step) else 1 + (0 if step.get("blend_radius") else len(step.get("via", ())))
        for step in steps
    )  # fmt: skip


@settings(max_examples=20, deadline=None)
@given(steps_of_programs, st.text(max_size=30))
def test_any_program_is_laid_out_and_any_other_text_refused(steps: list[dict[str, Any]], other: str) -> None:
    text = yaml_text({"name": "work", "steps": steps})
    instructions = read_program(text, "work.yaml").instructions
    assert len(instructions) == carried_out(steps)
    lines = text.splitlines()
    for instruction in instructions:
        assert lines[instruction.line - 1].lstrip(" ").startswith("- ")
    carried = [one.action.payload for one in instructions if isinstance(one.action, Carry)]
    assert carried == sorted(carried)
    for broken in (other, text + other):
        try:
            read_program(broken, "work.yaml")
        except InputError as refusal:
            assert str(refusal).isprintable()


def run_of(*steps: str, done: int = 0) -> ProgramRun:
    return ProgramRun("work", read_program(text_of(*steps), "work.yaml").instructions, done)


def test_a_run_waits_for_moves_rests_and_payloads() -> None:
    run = run_of("set: a", "move: [0, 0.1]", "dwell: 1", "pick: 0.1", "reset: a")
    assert list(run.due(5.0)) == [SetOutput("a", True), Move(0.0, 0.1)]
    assert list(run.due(6.0)) == []
    run.on_goal({"state": "moving", "goal": [0.0, 0.1]})
    run.on_goal({"state": "refused", "goal": [0.3, 0.1], "reason": "somebody else's"})
    assert list(run.due(6.0)) == []
    run.on_goal({"state": "arrived", "goal": [0.0, 0.1]})
    assert list(run.due(7.0)) == [Wait(1.0)]
    assert list(run.due(7.999)) == []
    assert list(run.due(8.0)) == [Carry(0.1)]
    assert list(run.due(8.0 + SETTLING)) == [SetOutput("a", False)]
    assert run.state is ProgramState.COMPLETED
    assert run.status() == {
        **{"state": "completed", "program": "work", "step": "5", "line": 7, "rounds": []},
        **{"action": {"SetOutput": {"pin": "a", "on": False}}, "done": 5, "of": 5},
    }


def test_the_status_tells_the_via_points_of_moves_that_go_round_them() -> None:
    run = run_of("move: [0, 0.1]", "{move: [0, 0.12], via: [[0.01, 0.11]], blend_radius: 0.002}")
    list(run.due(0.0))
    plain = {"x": 0.0, "y": 0.1, "assembly": 0, "duration": 0.0, "torque": 1.0, "speed": 1.0}
    assert run.status()["action"] == {"Move": plain}
    run.on_goal({"state": "arrived", "goal": [0.0, 0.1]})
    list(run.due(1.0))
    rounded = {**plain, "y": 0.12, "via": ((0.01, 0.11),), "blend_radius": (0.002,)}
    assert run.status()["action"] == {"Move": rounded}


@pytest.mark.parametrize(
    ("state", "ends"), [("refused", ProgramState.REFUSED), ("stopped", ProgramState.STOPPED)]
)  # fmt: skip
def test_what_becomes_of_a_move_ends_the_run_with_its_step(state: str, ends: ProgramState) -> None:
    run = run_of("move: [0, 0.1]", "move: [0, 0.2]", done=1)
    assert list(run.due(0.0)) == [Move(0.0, 0.2)]
    run.on_goal({"state": state, "goal": [0.0, 0.2], "reason": "out of reach"})
    assert list(run.due(1.0)) == []
    assert (run.state, run.reason) == (ends, "step 2 (line 4): out of reach")


def test_a_fault_ends_it_at_once_and_a_request_after_what_is_under_way() -> None:
    run = run_of("dwell: 1", "set: a")
    list(run.due(0.0))
    run.stop("tracking_lost: 5 mm")
    assert (run.state, run.reason) == (ProgramState.STOPPED, "step 1 (line 3): tracking_lost: 5 mm")
    run = run_of("dwell: 1", "set: a")
    list(run.due(0.0))
    run.end_after_this("ended by hand")
    assert list(run.due(0.5)) == []
    assert run.state is ProgramState.RUNNING
    assert list(run.due(1.0)) == []
    assert (run.state, run.status()["reason"]) == (ProgramState.STOPPED, "ended by hand")
