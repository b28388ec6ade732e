# SPDX-License-Identifier: Apache-2.0
"""Motions through points at given times: what is followed, and what is refused with which reason."""

from __future__ import annotations

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.planning.motion_queue import GoalRefused
from fivebar_control.planning.order_planning import plan_once
from fivebar_control.planning.orders import Conditions, Planned, TimedPoint
from fivebar_control.planning.timed_points import MOST_POINTS, knots_of, read_points, request_from
from fivebar_control.trajectory.path import Path
from fivebar_description.parameters import FiveBar

CONDITIONS = Conditions("dextar", 500, 2.0, 10.0)
REST, MODE = (0.0, 0.15), (1, -1)
P = TimedPoint


def planned(robot: FiveBar, joints: tuple[str, ...], *points: TimedPoint) -> Planned:
    wanted = read_points(joints, points)
    return plan_once(CONDITIONS, request_from(robot, wanted, REST, MODE, (math.nan, math.nan), 0.0))


def motors_at(robot: FiveBar, x: float, y: float) -> tuple[float, float]:
    state = state_from_platform(robot, MODE, x, y, 0.0, 0.0)
    return state.leg1.q1, state.leg2.q1


def test_points_are_passed_at_their_times(dextar: FiveBar) -> None:
    found = planned(dextar, ("y", "x"), P(0.6, (0.14, 0.02)), P(1.0, (0.13, 0.03)), P(1.7, (0.14, 0.0)))
    assert found.refused == ""
    path = found.path()
    for t, place in ((0.0, REST), (0.6, (0.02, 0.14)), (1.0, (0.03, 0.13)), (1.7, (0.0, 0.14))):
        assert path.at(t)[:2] == pytest.approx(place, abs=1e-12)
    assert math.hypot(*path.at(1.0)[2:4]) > 0.01
    assert path.duration == 1.7


def test_a_crossing_of_the_locus_is_taken_and_a_dwell_on_it_is_not(dextar: FiveBar) -> None:
    """As a planner would send it: with speeds and accelerations."""
    way = Path.through([REST, (0.0, 0.02)], [1.0])
    points = [P(t, at[:2], at[2:4], at[4:]) for t in (n / 20 for n in range(21)) for at in (way.at(t),)]
    found = planned(dextar, ("x", "y"), *points)
    assert found.refused == ""
    for t in (0.13, 0.5, 0.77):
        assert found.path().at(t)[:2] == pytest.approx(way.at(t)[:2], abs=1e-12)
    slow = [point._replace(time=60.0 * point.time, velocity=(), acceleration=()) for point in points]
    assert "Type 2" in planned(dextar, ("x", "y"), *slow).refused


def test_motors_are_turned_in_the_assembly_mode_in_which_they_rest(dextar: FiveBar) -> None:
    here = motors_at(dextar, *REST)
    found = planned(dextar, ("q21", "q11"), P(0.8, (here[1] - 0.15, here[0] + 0.1)))
    assert found.refused == ""
    end = found.path().at(0.8)
    assert motors_at(dextar, end.x, end.y) == pytest.approx((here[0] + 0.1, here[1] - 0.15), abs=1e-12)
    wanted = read_points(("q11", "q21"), [P(0.8, (here[0] + math.tau, here[1]))])
    turned = request_from(dextar, wanted, REST, MODE, (here[0] + math.tau + 1e-4, here[1]), 0.0)
    assert turned.points[0].position == pytest.approx((here[0] + math.tau, here[1]))


@pytest.mark.parametrize(
    ("joints", "points", "reason"),
    [
        (("x", "z"), [P(1.0, (0.0, 0.14))], "joint_names [x, z]: expected x and y for the platform, or q11 and q21"),
        (("x", "y", "q11"), [P(1.0, (0.0, 0.14, 1.0))], "expected x and y"),
        (("x", "x"), [P(1.0, (0.0, 0.14))], "joint_names [x, x]"),
        ((), [P(1.0, ())], "joint_names []"),
        (("x", "y"), [], f"0 points: expected 1 to {MOST_POINTS}"),
        (("x", "y"), [P(1.0, REST)] * (MOST_POINTS + 1), f"{MOST_POINTS + 1} points: expected 1 to {MOST_POINTS}"),
        (("x", "y"), [P(1.0, (0.0,))], "points[0].positions [0]: expected 2 finite numbers"),
        (("x", "y"), [P(1.0, (math.nan, 0.14))], "points[0].positions [nan, 0.14]: expected 2 finite numbers"),
        (("x", "y"), [P(1.0, (0.0, math.inf))], "points[0].positions [0, inf]"),
        (("x", "y"), [P(1.0, (0.0, 1e7))], "of at most 1e+06 in magnitude"),
        (("x", "y"), [P(1.0, (0.0, 0.14), (0.0,))], "points[0].velocities [0]: expected 2"),
        (("x", "y"), [P(1.0, REST, (0.1, 0.0)), P(2.0, REST)], "points[1].velocities []: expected 2"),
        (("x", "y"), [P(1.0, REST), P(2.0, REST, (0.0, 0.0))], "expected none, as in the first point"),
        (("x", "y"), [P(1.0, REST, (), (0.0, 0.0))], "points[0].accelerations: expected only beside velocities"),
        (("x", "y"), [P(1.0, REST), P(1.0, (0.0, 0.14))], "points[1].time_from_start: 1 s after 1 s: expected times"),
        (("x", "y"), [P(-1.0, REST), P(1.0, (0.0, 0.14))], "time_from_start: -1 to 1 s: expected times from 0"),
        (("x", "y"), [P(1e6, REST)], "expected times from 0 to 86400 s"),
        (("x", "y"), [P(0.0, (0.0, 0.14)), P(1.0, REST)], "points[0] at time 0: (0.0000, 0.1400) m: expected where"),
        (("q11", "q21"), [P(0.0, (0.0, 0.14)), P(1.0, REST)], "rad: expected where the robot rests"),
        (("x", "y"), [P(0.0, REST)], "points: expected one at least after time 0"),
        (("x", "y"), [P(0.0, REST, (0.1, 0.0)), P(1.0, REST, (0.0, 0.0))], "the motion begins at rest: expected 0"),
        (("x", "y"), [P(1.0, REST, (0.0, 0.1))], "points[0].velocities: the motion ends at rest: expected 0"),
    ],
)
def test_what_is_no_request_is_refused(
    dextar: FiveBar, joints: tuple[str, ...], points: list[TimedPoint], reason: str
) -> None:
    with pytest.raises(GoalRefused) as refusal:
        planned(dextar, joints, *points)
    assert reason in str(refusal.value)


@pytest.mark.parametrize(
    ("joints", "points", "reason"),
    [
        (("x", "y"), [P(1.0, (0.3, 0.1))], "the platform is out of reach"),
        (("x", "y"), [P(0.05, (0.0, 0.12))], "torque"),
        (("x", "y"), [P(1.0, (0.0, 0.0845))], "expected at least"),
        (("q11", "q21"), [P(2.0, (3.1, 0.0))], "Type 2 locus, where they do not fix the platform: expected x and y"),
        (("q11", "q21"), [P(2.0, (1.0, 2.1))], "singularity"),
    ],
)
def test_what_the_robot_cannot_is_refused_with_the_reason(
    dextar: FiveBar, joints: tuple[str, ...], points: list[TimedPoint], reason: str
) -> None:
    found = planned(dextar, joints, *points)
    assert reason in found.refused
    assert found.segments == ()


NUMBERS = st.floats() | st.sampled_from([0.0, 0.15, 1.0])
COLUMNS = st.lists(NUMBERS, max_size=3).map(tuple)


@given(
    st.lists(st.sampled_from(["x", "y", "q11", "q21", ""]), max_size=3),
    st.lists(st.builds(TimedPoint, NUMBERS, COLUMNS, COLUMNS, COLUMNS), max_size=4),
)
def test_any_message_is_a_request_or_refused(dextar: Any, joints: list[str], points: list[TimedPoint]) -> None:
    try:
        wanted = read_points(joints, points)
        request = request_from(dextar, wanted, REST, MODE, (1.6, 1.5), 0.0)
    except GoalRefused as refusal:
        assert str(refusal)
        return
    assert all(math.isfinite(value) for knot in knots_of(request) for value in knot)
    assert request.points[0].time == 0.0
