# SPDX-License-Identifier: Apache-2.0
"""Motions on request: what is returned holds under an independent look, and what is not says why."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from fivebar_control.laws.registry import CONTROLLERS, TunedController, default_tuning
from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.singularity import distal_links, inverse_condition
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.course import Course
from fivebar_control.planning.limits import MotionLimits, motion_limits_of
from fivebar_control.planning.pacing import NoPace, Task, pace_of, retimed, slowest_pace
from fivebar_control.planning.postures import WORKING_MODES, place_at, rest_problem
from fivebar_control.planning.roadmap import roadmap
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import Transfer, TransferRefused, plan_transfer
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.time_laws import OPTIMAL, QUINTIC
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar, friction_torque
from fivebar_description.robot_file import ElbowsPass, load_robot

RATE_HZ = 500
ROBOTS = {name: load_robot(name) for name in ("dextar", "unequal")}
UNIFIED, BLENDED = (default_tuning(CONTROLLERS[name]) for name in ("unified", "multi_cartesian"))


def expect_feasible(robot: FiveBar, mode: WorkingMode, transfer: Transfer, limits: MotionLimits) -> None:
    """Look at four times as many moments as a controller does, with the equations of the model only."""
    path = transfer.plan.path
    near_since, crossings, before = None, 0, 0.0
    for t in np.linspace(0.0, path.duration, round(path.duration * RATE_HZ * 4) + 1).tolist():
        p = path.at(t)
        state = state_from_platform(robot, mode, p.x, p.y, p.vx, p.vy)
        assert min(abs(state.leg1.sin_q2), abs(state.leg2.sin_q2)) >= limits.serial_margin - 1e-5
        assert max(abs(state.leg1.dq1), abs(state.leg2.dq1)) <= 0.9 * limits.motor_speed * 1.001
        determinant = det_a(state)
        crossings += determinant * before < 0.0
        before = determinant
        if inverse_condition(state) < 0.05:
            near_since = t if near_since is None else near_since
            assert t - near_since <= limits.dwell + 1e-3
        else:
            near_since = None
            friction = friction_torque(robot.leg1, state.leg1.dq1), friction_torque(robot.leg2, state.leg2.dq1)
            if inverse_condition(state) > 0.3:
                # outside every blending zone all controllers need the inverse dynamics
                torque = inverse_dynamics_of_platform(robot, state, p.ax, p.ay, *friction)
                assert max(map(abs, torque)) <= 0.85 * limits.torque * 1.002
    assert crossings == len(transfer.plan.crossings)
    for x, y in transfer.waypoints:
        assert rest_problem(robot, mode, x, y, limits) is None


coordinate = st.floats(-0.18, 0.18)


@pytest.mark.extra
@settings(max_examples=6)
@given(
    name=st.sampled_from(sorted(ROBOTS)),
    mode=st.sampled_from(WORKING_MODES),
    follower=st.sampled_from([UNIFIED, BLENDED]),
    speed=st.sampled_from(list(Speed)),
    start=st.tuples(coordinate, coordinate),
    goal=st.tuples(coordinate, coordinate),
)
def test_any_two_rests_get_a_feasible_motion_or_a_reason(
    name: str,
    mode: WorkingMode,
    follower: TunedController,
    speed: Speed,
    start: tuple[float, float],
    goal: tuple[float, float],
) -> None:
    robot, limits = ROBOTS[name], motion_limits_of(follower)
    assume(all(rest_problem(robot, mode, *point, limits) is None for point in (start, goal)))
    assume(math.dist(start, goal) > 1e-3)
    try:
        transfer = plan_transfer(Task(robot, mode, RATE_HZ, follower, limits), start, goal, duration=speed)
    except TransferRefused as refusal:
        assert "expected" in str(refusal) or "no gate" in str(refusal)
        return
    assert (transfer.waypoints[0], transfer.waypoints[-1]) == (start, goal)
    expect_feasible(robot, mode, transfer, limits)
    parted = place_at(robot, mode, *start).assembly != place_at(robot, mode, *goal).assembly
    assert len(transfer.crossings) % 2 == parted


def random_rests(robot: FiveBar, mode: WorkingMode, seed: int) -> tuple[tuple[float, float], tuple[float, float]]:
    random = np.random.default_rng(seed)
    found: list[tuple[float, float]] = []
    while len(found) < 2:
        x, y = random.uniform((-0.13, -0.18), (0.13, 0.18)).tolist()
        if rest_problem(robot, mode, x, y, MotionLimits()) is None:
            found.append((x, y))
    return found[0], found[1]


@pytest.mark.extra
def test_nearly_every_pair_is_joined(dextar: FiveBar) -> None:
    """Of 8 random pairs none is refused: the map leaves no part of the workspace out."""
    for seed in range(8):
        mode = WORKING_MODES[seed % 4]
        start, goal = random_rests(dextar, mode, seed)
        plan_transfer(Task(dextar, mode, RATE_HZ), start, goal)


def test_a_straight_line_where_that_will_do(dextar: FiveBar) -> None:
    transfer = plan_transfer(Task(dextar, (1, -1), RATE_HZ), (0.0, 0.15), (0.0, 0.02), -1)
    assert transfer.waypoints == ((0.0, 0.15), (0.0, 0.02))
    (crossing,) = transfer.crossings
    assert (crossing.x, crossing.y) == pytest.approx((0.0, math.sqrt(0.0081 - 0.000961)))
    assert crossing.distal_links == "stretched"
    assert (transfer.assembly_start, transfer.assembly_goal) == (1, -1)


def test_elbows_that_must_not_pass_are_led_around(dextar: FiveBar) -> None:
    start, goal = (0.063, -0.051), (0.018, 0.017)
    for allowed in ("unknown", True):
        straight = plan_transfer(Task(dextar, (1, -1), RATE_HZ, limits=MotionLimits(elbows_pass=allowed)), start, goal)
        assert [crossing.distal_links for crossing in straight.crossings] == ["folded"]
        assert straight.waypoints == (start, goal)
    around = plan_transfer(Task(dextar, (1, -1), RATE_HZ, limits=MotionLimits(elbows_pass=False)), start, goal)
    assert [crossing.distal_links for crossing in around.crossings] == ["stretched"]
    with pytest.raises(TransferRefused) as refusal:
        via = (0.04, -0.018)
        plan_transfer(Task(dextar, (1, -1), RATE_HZ, limits=MotionLimits(elbows_pass=False)), start, goal, via=[via])
    assert "elbows pass each other (elbows_pass: false) is 1 at (" in str(refusal.value)


@pytest.mark.parametrize(("allowed", "crossed"), [(True, "folded"), ("unknown", "stretched"), (False, "stretched")])
def test_the_map_prefers_gates_at_which_elbows_stay_apart(dextar: FiveBar, allowed: ElbowsPass, crossed: str) -> None:
    limits = MotionLimits()
    chart = roadmap(dextar, (1, 1), limits.serial_margin, limits.rest, allowed)
    way = chart.way((0.035, 0.144), (0.077, -0.072))
    assert way is not None
    (gate,) = way.gates
    middle = np.mean(gate, axis=0).tolist()
    assert distal_links(state_from_platform(dextar, (1, 1), *middle, 0.0, 0.0)) == crossed


def test_only_laws_that_hold_the_path_by_its_normal_go_around_where_that_cannot_be_controlled(dextar: FiveBar) -> None:
    """The straight line crosses the locus nearly across t_s, so that the path's normal is t_s itself."""
    start, goal = (0.0153, 0.0703), (0.0006, -0.0286)
    straight = plan_transfer(Task(dextar, (-1, 1), RATE_HZ, UNIFIED), start, goal)
    assert straight.waypoints == (start, goal)
    assert straight.crossings[0].authority < 0.06
    expect_feasible(dextar, (-1, 1), straight, MotionLimits())
    around = plan_transfer(Task(dextar, (-1, 1), RATE_HZ, BLENDED, motion_limits_of(BLENDED)), start, goal)
    assert len(around.waypoints) > 2
    assert min(crossing.authority for crossing in around.crossings) >= 0.3


def test_only_laws_with_blending_zones_rest_outside_of_them(dextar: FiveBar) -> None:
    """A rest at 1/cond(A) = 0.17, to which a quick crossing leads: its zone would reach as far."""
    start, goal = (0.0, 0.15), (0.0, 0.07)
    direct = plan_transfer(Task(dextar, (1, -1), RATE_HZ, UNIFIED), start, goal, duration=0.5)
    assert direct.waypoints == (start, goal)
    expect_feasible(dextar, (1, -1), direct, MotionLimits())
    with pytest.raises(TransferRefused, match=r"in 0\.5 s 1/cond\(A\) at rest is 0\.168 .*, expected at least 0\.198"):
        plan_transfer(Task(dextar, (1, -1), RATE_HZ, BLENDED, motion_limits_of(BLENDED)), start, goal, duration=0.5)


def test_around_the_locus_rather_than_through_it_twice(dextar: FiveBar) -> None:
    """In one assembly mode, on both sides of the region of the other."""
    start, goal = (0.0, 0.15), (0.0, -0.11)
    signs = [place_at(dextar, (1, -1), 0.0, y).assembly for y in np.linspace(start[1], goal[1], 200).tolist()]
    assert sum(one != other for one, other in pairwise(signs)) == 2
    transfer = plan_transfer(Task(dextar, (1, -1), RATE_HZ), start, goal, 1)
    assert transfer.crossings == ()
    assert len(transfer.waypoints) > 2
    expect_feasible(dextar, (1, -1), transfer, MotionLimits())


def test_through_the_locus_twice_where_there_is_no_other_way(dextar: FiveBar) -> None:
    """The tip of the workspace has the assembly mode of the middle, and the other one lies between them."""
    assert place_at(dextar, (-1, 1), 0.0, 0.167).assembly == place_at(dextar, (-1, 1), 0.0, -0.02).assembly == 1
    transfer = plan_transfer(Task(dextar, (-1, 1), RATE_HZ), (0.0, 0.167), (0.0, -0.02), 1)
    assert len(transfer.crossings) == 2
    expect_feasible(dextar, (-1, 1), transfer, MotionLimits())


def test_around_the_hole_at_a_base(dextar: FiveBar) -> None:
    """A leg that folds is Type 1: no way leads within 13.5 mm of its base."""
    transfer = plan_transfer(Task(dextar, (1, 1), RATE_HZ), (-0.09, 0.02), (-0.03, 0.02))
    expect_feasible(dextar, (1, 1), transfer, MotionLimits())


@pytest.mark.parametrize(
    ("mode", "start", "goal", "assembly", "expected"),
    [
        ((1, -1), (0.0, 0.15), (0.3, 0.1), None, r"^goal: .* out of reach of leg 1 by "),
        ((1, -1), (0.0, 0.15), (math.nan, 0.1), None, r"^goal: .* expected finite coordinates"),
        ((1, -1), (0.0, 0.15), (0.0, 0.1698), None, r"^goal: .* Type 1 singularity: \|sin q_i2\| = 0\.1"),
        ((1, -1), (0.0, 0.15), (0.0, 0.0845), None, r"^goal: .* Type 2 singularity for a rest"),
        ((1, -1), (0.0, 0.085), (0.0, 0.02), None, r"^start: .* Type 2 singularity for a rest"),
        ((1, -1), (0.0, 0.15), (0.0, 0.15), None, r"rests at \(0\.0000, 0\.1500\) m already"),
        ((1, -1), (0.0, 0.15), (0.0, 0.12), -1, r"assembly mode - needs working mode \(-1, \+1\), .* Type 1"),
        ((1, -1), (0.0, 0.15), (0.0, 0.02), 1, r"assembly mode \+ needs working mode .*\(\+1, \+1\)"),
    ],
)
def test_a_refusal_says_why(
    dextar: FiveBar,
    mode: WorkingMode,
    start: tuple[float, float],
    goal: tuple[float, float],
    assembly: int | None,
    expected: str,
) -> None:
    with pytest.raises(TransferRefused, match=expected):
        plan_transfer(Task(dextar, mode, RATE_HZ), start, goal, assembly)


def test_little_torque_makes_it_slower_or_impossible(dextar: FiveBar) -> None:
    def fastest(torque: float) -> float:
        found = plan_transfer(
            Task(dextar, (1, -1), RATE_HZ, limits=MotionLimits(torque=torque)),
            (0.0, 0.15),
            (0.0, 0.02),
            -1,
            Speed.FASTEST,
        )
        expect_feasible(dextar, (1, -1), found, MotionLimits(torque=torque))
        return sum(found.durations)

    assert fastest(0.6) > 2.0 * fastest(2.0)
    with pytest.raises(TransferRefused, match=r"even in .* longest possible .* reference torque is 0\.4"):
        fastest(0.45)


def test_a_duration_that_is_too_short_or_too_long_is_refused_with_the_possible_ones(dextar: FiveBar) -> None:
    def plan(duration: float) -> Transfer:
        return plan_transfer(
            Task(dextar, (1, -1), RATE_HZ, limits=MotionLimits(torque=0.6)), (0.0, 0.15), (0.0, 0.02), -1, duration
        )

    assert sum(plan(2.0).durations) == pytest.approx(2.0)
    with pytest.raises(TransferRefused, match=r"in 0\.3 s reference torque is .*possible are about 1\.\d+ to 5\.\d+ s"):
        plan(0.3)
    with pytest.raises(TransferRefused, match=r"in 7 s time near the Type 2 locus is 0\.2\d+ s"):
        plan(7.0)


@pytest.mark.parametrize(
    ("start", "goal", "law"),
    [
        ((0.0, 0.15), (0.0, 0.02), OPTIMAL),
        ((0.0, 0.15), (0.03, 0.13), OPTIMAL),
        ((-0.02, 0.13), (0.02, 0.03), QUINTIC),
    ],
)
def test_the_fastest_motion_is_that_of_the_quicker_time_law(
    dextar: FiveBar, start: tuple[float, float], goal: tuple[float, float], law: str
) -> None:
    limits = MotionLimits(torque=0.6)
    found = plan_transfer(Task(dextar, (1, -1), RATE_HZ, limits=limits), start, goal, duration=Speed.FASTEST)
    expect_feasible(dextar, (1, -1), found, limits)
    task, least = Task(dextar, (1, -1), RATE_HZ, UNIFIED, limits), {}
    for time_law in (QUINTIC, OPTIMAL):
        slowest = slowest_pace(task, Course((start, goal), (), time_law))
        assert not isinstance(slowest, NoPace), slowest.reason
        least[time_law] = pace_of(task, slowest).fastest
    assert found.course.time_law == law == min(least, key=lambda one: least[one])
    assert sum(found.durations) == pytest.approx(least[law], abs=1e-9)


@pytest.mark.parametrize("follower", [UNIFIED, BLENDED], ids=["unified", "blended"])
def test_every_duration_between_the_fastest_and_the_slowest_is_feasible(
    dextar: FiveBar, follower: TunedController
) -> None:
    """And none below: what bisection takes for granted."""
    task = Task(dextar, (1, -1), RATE_HZ, follower, motion_limits_of(follower, torque=1.0))
    for start, goal in [((0.0, 0.15), (0.02, 0.02)), ((-0.1, 0.05), (0.0, 0.04)), ((0.05, 0.11), (-0.05, 0.13))]:
        slowest = slowest_pace(task, Course((start, goal)))
        assert not isinstance(slowest, NoPace), slowest.reason
        pace = pace_of(task, slowest)
        durations = np.geomspace(0.5 * pace.fastest, pace.slowest, 24).tolist()
        for duration in durations:
            verdict = task.judge(retimed(task, slowest, duration / pace.slowest))
            if duration >= pace.fastest:
                assert verdict.feasible, (duration, pace, verdict.reasons)
            elif duration < pace.fastest * 0.985:
                assert not verdict.feasible, (duration, pace)


def test_a_retimed_plan_is_the_plan_of_that_duration(dextar: FiveBar) -> None:
    ends = ((0.0, 0.15), (0.0, 0.03))
    task = Task(dextar, (1, -1), RATE_HZ, UNIFIED, motion_limits_of(UNIFIED, torque=1.0))
    found = retimed(task, plan_motion(dextar, (1, -1), ends, (2.0,), RATE_HZ, ZoneRule()), 0.4)
    expected = plan_motion(dextar, (1, -1), ends, (0.8,), RATE_HZ, ZoneRule())
    assert found.crossings[0][:-1] == pytest.approx(expected.crossings[0][:-1], rel=1e-9)
    assert found.crossings[0].distal_links == expected.crossings[0].distal_links
    assert found.path.at(0.3) == pytest.approx(expected.path.at(0.3), rel=1e-12)


def test_planning_gives_the_same_each_time(dextar: FiveBar) -> None:
    found = [plan_transfer(Task(dextar, (1, -1), RATE_HZ), (0.0, 0.15), (0.0, -0.11)) for _ in range(2)]
    assert found[0].waypoints == found[1].waypoints
    assert found[0].durations == found[1].durations
    assert len(found[0].waypoints) > 2


def test_durations_are_whole_samples(dextar: FiveBar) -> None:
    transfer = plan_transfer(Task(dextar, (1, -1), RATE_HZ), (0.0, 0.15), (-0.05, -0.1))
    times = [segment.start_time for segment in transfer.plan.path.segments]
    assert [t * RATE_HZ for t in times] == pytest.approx([round(t * RATE_HZ) for t in times])
    for point, t in zip(transfer.waypoints, [*times, transfer.plan.path.duration], strict=True):
        assert transfer.plan.path.at(t)[:2] == pytest.approx(point)
