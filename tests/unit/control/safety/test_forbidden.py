# SPDX-License-Identifier: Apache-2.0
"""Postures that the user forbids: how soon the robot is in one, what the guard does, and what the planner refuses."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml
from hypothesis import assume, example, given
from hypothesis import strategies as st

from fivebar_bringup.runs.admission import refuse_unfit
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import State
from fivebar_control.safety.forbidden import FORESEEN, stay_at_angle, stay_between, time_to_posture
from fivebar_control.safety.guard import Guard
from fivebar_control.safety.settings import SafetySettings
from fivebar_control.scenario.guard_settings import guard_settings
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_description.files import share_file
from fivebar_description.forbidden import NOWHERE, PostureBounds
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import InputError

ROBOT = load_robot("motkin")
MODES = (1, -1)
TURN = 2.0 * math.pi
STEPS = 40


def moving(x: float, y: float, vx: float = 0.0, vy: float = 0.0) -> State:
    return state_from_platform(ROBOT, MODES, x, y, vx, vy)


def ranges(least: float, most: float, width: float) -> st.SearchStrategy[tuple[float, float]]:
    return st.tuples(st.floats(least, most), st.floats(1e-3, width)).map(lambda one: (one[0], one[0] + one[1]))


def within(bounds: PostureBounds, state: State, time: float, slack: float) -> bool:
    """Whether the state is in a posture a time (s) later, with so much room beyond its ranges, angles in any turn."""
    low, high = bounds[::2], bounds[1::2]
    values = (state.x + time * state.vx, state.y + time * state.vy)
    angles = (state.leg1.q1 + time * state.leg1.dq1, state.leg2.q1 + time * state.leg2.dq1)
    inside = [low[i] - slack <= values[i] <= high[i] + slack for i in range(2)]
    for i, angle in enumerate(angles, start=2):
        near = [angle + turn * TURN for turn in range(-3, 4)]
        inside.append(any(low[i] - slack <= one <= high[i] + slack for one in near))
    return all(inside)


@given(
    st.tuples(st.floats(-0.03, 0.03), st.floats(0.06, 0.13), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)),
    ranges(-0.04, 0.04, 0.05),
    ranges(0.05, 0.14, 0.05),
    ranges(-4.0, 4.0, 3.0),
    ranges(-4.0, 4.0, 3.0),
)
@example((0.0, 0.12, 0.0, -1.0), (-0.01, 0.01), (0.08, 0.1), (-math.pi, math.pi), (0.5, 0.5 + TURN))
def test_the_time_to_a_posture_is_when_it_is_first_entered(
    motion: tuple[float, float, float, float],
    x: tuple[float, float],
    y: tuple[float, float],
    q11: tuple[float, float],
    q21: tuple[float, float],
) -> None:
    state, bounds = moving(*motion), PostureBounds(*x, *y, *q11, *q21)
    # angles are taken on the turn that is nearest now: within half a turn of motion that is the only one
    span = 0.02
    assume(max(abs(state.leg1.dq1), abs(state.leg2.dq1)) * span < 0.05)
    found = time_to_posture(bounds, state)
    entered = [step / STEPS * span for step in range(STEPS + 1) if within(bounds, state, step / STEPS * span, -1e-6)]
    if entered:
        assert found <= entered[0] + 1e-9
    if found <= span:
        assert within(bounds, state, found, 1e-6)


ALWAYS, NEVER = (-math.inf, math.inf), (math.inf, -math.inf)


@pytest.mark.parametrize(
    ("value", "rate", "stay"),
    [
        (0.0, 0.5, (2.0, 4.0)),
        (0.0, -0.5, (-4.0, -2.0)),
        (1.5, 0.5, (-1.0, 1.0)),
        (1.0, 0.0, ALWAYS),
        (2.0, 0.0, ALWAYS),
        (0.9, 0.0, NEVER),
        (2.1, 0.0, NEVER),
    ],
)
def test_a_quantity_is_in_a_range_from_one_bound_to_the_other(
    value: float, rate: float, stay: tuple[float, float]
) -> None:
    assert stay_between(1.0, 2.0, value, rate) == stay


@pytest.mark.parametrize("turns", [0, 1, -2])
def test_an_angle_is_in_a_range_on_the_nearest_turn(turns: int) -> None:
    whole = turns * TURN
    for angle, rate, stay in ((0.0, 1.0, (0.5, 1.5)), (0.0, -1.0, (-1.5, -0.5)), (2.0, -0.5, (1.0, 3.0))):
        assert stay_at_angle(0.5, 1.5, angle + whole, rate) == pytest.approx(stay, abs=1e-12)
    # opposite to the middle of the range, just outside of one that is almost a turn, and wherever in a whole one
    assert stay_at_angle(-3.0, 3.0, math.pi + whole, 0.0) == NEVER
    for rate in (1.0, -1.0, 0.0):
        assert stay_at_angle(-math.pi, math.pi, 1.0 + whole, rate) == ALWAYS
        assert stay_at_angle(0.0, 9.0, 1.0 + whole, rate) == ALWAYS


def test_a_posture_has_its_bounds() -> None:
    """On its edge, on the way out, and in the one moment in which one range is left and the other entered."""
    bounds = PostureBounds(0.0, 0.5, 0.25, 0.5, -math.pi, math.pi, -math.pi, math.pi)
    state = moving(0.0, 0.12)
    assert time_to_posture(bounds, state._replace(x=0.5, y=0.25, vx=1.0, vy=0.0)) == 0.0
    assert time_to_posture(bounds, state._replace(x=0.0, y=0.0, vx=0.5, vy=0.25)) == 1.0
    assert time_to_posture(bounds, state._replace(x=0.0, y=0.0, vx=0.5, vy=0.24)) == math.inf
    assert time_to_posture(NOWHERE, state) == math.inf


def test_the_guard_stops_the_robot_before_it_is_in_one_and_names_it() -> None:
    settings = SafetySettings(forbidden=(-0.1, 0.1, -0.1, 0.1, -4.0, 4.0, -4.0, 4.0))
    push = Torque(0.01, -0.01)
    for y, vy, stops in ((0.12, -0.5, False), (0.1 + 0.5 * FORESEEN - 1e-4, -0.5, True), (0.105, 0.5, False)):
        guard = Guard(ROBOT, MODES, 500, settings)
        state = moving(0.0, y, 0.0, vy)
        decision = guard.command(7, state, (0.0, y), 0.0, push, push)
        assert (guard.fault is not None) == stops
        if guard.fault is not None:
            assert decision.applied != push
            assert guard.brakes
            assert str(guard.fault).startswith("forbidden_posture: at sample 7: platform at (0.0000, 0.1099) m")
            assert str(guard.fault).endswith("ms before forbidden posture 1")
            assert guard.command(8, moving(0.0, 0.09), (0.0, 0.09), 0.0, push, push).requested is None
            assert "the robot is in forbidden posture 1" in (guard.reset() or "")
            guard.command(9, moving(0.0, 0.12), (0.0, 0.12), 0.0, push, push)
            assert guard.reset() is None
        else:
            assert decision.applied == push
    assert guard.stop(moving(0.0, 0.12)) == ZERO


def forbidding(folder: Path, *postures: dict[str, object]) -> Path:
    """Return the bench's file with forbidden postures."""
    content = yaml.safe_load(share_file("fivebar_description", "config", "motkin.yaml").read_text(encoding="utf-8"))
    path = folder / "bench.yaml"
    path.write_text(yaml.safe_dump(content | {"forbidden": list(postures)}), encoding="utf-8")
    return path


def test_the_screen_refuses_a_motion_through_one_with_its_name_and_place(tmp_path: Path) -> None:
    beside = {"name": "screw over the base", "x": [0.01, 0.05], "y": [0.0, 0.05]}
    through = {"name": "over motor 1", "y": [0.0, 0.05], "q11": [1.5, 2.5]}
    content = load_scenario("motkin_middle").model_dump(mode="json")

    def scenario(*postures: dict[str, object]) -> Scenario:
        return Scenario.model_validate(content | {"robot": str(forbidding(tmp_path, *postures))})

    clear = scenario(beside)
    refuse_unfit(clear)
    assert guard_settings(clear).forbidden[:4] == (0.01, 0.05, 0.0, 0.05)
    with pytest.raises(
        PlanRefused, match=r"time to the forbidden posture 'over motor 1' is 0 s at \(0\.0000, 0\.0\d+\) m"
    ):
        refuse_unfit(scenario(beside, through))


@pytest.mark.parametrize(
    ("posture", "problem"),
    [
        ({"name": "all"}, "without any, every posture is forbidden"),
        ({"name": "none", "x": [0.1, 0.0]}, "x: expected the least value before the largest one"),
    ],
)
def test_postures_that_say_nothing_are_refused(tmp_path: Path, posture: dict[str, object], problem: str) -> None:
    with pytest.raises(InputError, match=problem):
        load_robot(str(forbidding(tmp_path, posture)))
