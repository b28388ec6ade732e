# SPDX-License-Identifier: Apache-2.0
"""The planner: where a motion crosses the locus, how wide the zones are, and what it refuses."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import pytest
from scipy.optimize import brentq

from fivebar_control.laws.blend import blending_weight
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.singularity import inverse_condition, parallel_svd
from fivebar_control.model.state import State
from fivebar_control.trajectory.planner import Plan, PlanRefused, plan_motion
from fivebar_control.trajectory.refusal import place
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError

States = Callable[[int, int], list[State]]
Waypoints = Sequence[tuple[float, float]]

OUTWARDS = (1, -1)
MIDDLE = ((0.0, 0.15), (0.0, 0.02), (0.0, 0.15))
A, B, C, D, E, F = (0.0, 0.15), (0.0, 0.035), (-0.025, 0.025), (-0.025, 0.125), (0.025, 0.025), (0.025, 0.125)
MULTIPLE = (A, B, A, B, A, C, D, A, E, F, A)
LOCUS_Y = math.sqrt(0.0081 - 0.000961)


def plan(
    robot: FiveBar,
    waypoints: Waypoints,
    duration: float = 1.0,
    rate_hz: int = 500,
    rule: ZoneRule | None = None,
    working_mode: Sequence[int] = OUTWARDS,
) -> Plan:
    durations = [duration] * (len(waypoints) - 1)
    return plan_motion(robot, working_mode, waypoints, durations, rate_hz, rule if rule is not None else ZoneRule())


def kappa_at(robot: FiveBar, planned: Plan, t: float) -> float:
    """1 / cond(A) of the reference, by numpy."""
    at = planned.path.at(t)
    state = state_from_platform(robot, planned.mode, at.x, at.y, 0.0, 0.0)
    a = np.array([[state.leg1.u_x, state.leg1.u_y], [state.leg2.u_x, state.leg2.u_y]])
    return 1.0 / float(np.linalg.cond(a))


def mode_changes(robot: FiveBar, planned: Plan) -> list[float]:
    """The instants at which the reference changes its assembly mode, from samples 1 ms apart."""

    def assembly(t: float) -> bool:
        at = planned.path.at(t)
        return det_a(state_from_platform(robot, planned.mode, at.x, at.y, 0.0, 0.0)) > 0.0

    times = [step * 1e-3 for step in range(math.ceil(planned.path.duration * 1e3) + 1)]
    return [after for before, after in pairwise(times) if assembly(before) != assembly(after)]


def test_the_middle_trajectory_crosses_twice_where_the_locus_is(dextar: FiveBar) -> None:
    planned = plan(dextar, MIDDLE)
    assert [crossing.segment for crossing in planned.crossings] == [0, 1]
    for crossing in planned.crossings:
        assert (crossing.x, crossing.y) == pytest.approx((0.0, LOCUS_Y), abs=1e-14)
        assert crossing.authority == pytest.approx(1.0, abs=1e-12)
    # the way up is the way down in a mirror
    down, up = planned.crossings
    assert down.time + up.time == pytest.approx(2.0, abs=1e-12)
    fraction = (0.15 - LOCUS_Y) / 0.13
    u = brentq(lambda u: 10 * u**3 - 15 * u**4 + 6 * u**5 - fraction, 0.0, 1.0, xtol=1e-15)
    assert down.time == pytest.approx(u, abs=1e-13)


@pytest.mark.parametrize("duration", [0.5, 1.0, 3.0])
def test_the_multiple_trajectory_of_section_4_2_crosses_eight_times(dextar: FiveBar, duration: float) -> None:
    planned = plan(dextar, MULTIPLE, duration)
    assert len(planned.crossings) == 8
    assert [crossing.segment for crossing in planned.crossings] == [0, 1, 2, 3, 4, 5, 7, 8]
    changes = mode_changes(dextar, planned)
    assert len(changes) == 8
    for crossing, change in zip(planned.crossings, changes, strict=True):
        assert 0.0 <= change - crossing.time <= 1.0001e-3
        assert kappa_at(dextar, planned, crossing.time) < 1e-12
        assert crossing.authority > 0.9


def test_a_motion_away_from_the_locus_crosses_nothing(dextar: FiveBar) -> None:
    planned = plan(dextar, ((0.0, 0.15), (0.0, 0.12)))
    assert planned.crossings == ()
    assert planned.epsilon_at(0.3) == 0.0


def test_both_robots_and_all_working_modes_have_their_own_crossings(robot: FiveBar) -> None:
    """A straight sweep through the middle of the workspace; refusals aside, crossings are the changes of mode."""
    counted = 0
    for working_mode in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
        try:
            planned = plan(robot, ((0.0, 0.15), (0.01, 0.03)), rule=ZoneRule(epsilon=0.001), working_mode=working_mode)
        except PlanRefused:
            continue
        assert planned.mode == working_mode
        assert len(mode_changes(robot, planned)) == len(planned.crossings)
        counted += len(planned.crossings)
    assert counted >= 1


def test_rate_of_kappa_at_a_crossing_is_that_of_the_reference(dextar: FiveBar) -> None:
    planned = plan(dextar, MULTIPLE, 0.7)
    h = 1e-6
    for crossing in planned.crossings:
        for side in (-h, h):
            slope = kappa_at(dextar, planned, crossing.time + side) / h
            assert crossing.kappa_rate == pytest.approx(slope, rel=1e-4)


@pytest.mark.parametrize("waypoints", [MIDDLE, MULTIPLE])
@pytest.mark.parametrize("duration", [0.5, 1.0, 2.0, 3.0])
def test_ballistic_zones_hold_sigma_1_for_their_duration(
    dextar: FiveBar, waypoints: Waypoints, duration: float
) -> None:
    """Kappa is nearly straight over 40 ms, so the time at sigma = 1 comes out within 2 % of T_b."""
    planned = plan(dextar, waypoints, duration, rule=ZoneRule(duration=0.040))
    step = 1e-4
    for crossing in planned.crossings:
        assert crossing.epsilon == pytest.approx(0.5 * 0.040 * crossing.kappa_rate, rel=1e-12)
        held = sum(
            blending_weight(kappa_at(dextar, planned, crossing.time + index * step), crossing.epsilon) == 1.0
            for index in range(-400, 401)
        )
        assert held * step == pytest.approx(0.040, rel=0.02)


def test_a_ballistic_zone_holds_at_least_ten_samples(dextar: FiveBar) -> None:
    slow = plan(dextar, MIDDLE, rate_hz=100, rule=ZoneRule(duration=0.040))
    fast = plan(dextar, MIDDLE, rate_hz=1000, rule=ZoneRule(duration=0.040))
    short = plan(dextar, MIDDLE, rate_hz=1000, rule=ZoneRule(duration=0.001))
    assert slow.crossings[0].epsilon == pytest.approx(0.05 * slow.crossings[0].kappa_rate, rel=1e-12)
    assert fast.crossings[0].epsilon == pytest.approx(0.02 * fast.crossings[0].kappa_rate, rel=1e-12)
    assert short.crossings[0].epsilon == pytest.approx(0.005 * short.crossings[0].kappa_rate, rel=1e-12)


def test_a_fixed_zone_is_the_same_at_every_crossing(dextar: FiveBar) -> None:
    planned = plan(dextar, MULTIPLE, rule=ZoneRule(epsilon=0.07))
    assert {crossing.epsilon for crossing in planned.crossings} == {0.07}


def test_the_zone_in_force_is_that_of_the_nearest_crossing(dextar: FiveBar) -> None:
    planned = plan_motion(dextar, OUTWARDS, MIDDLE, (0.5, 2.0), 500, ZoneRule())
    first, second = planned.crossings
    assert first.epsilon > 3.0 * second.epsilon
    half_way = 0.5 * (first.time + second.time)
    assert planned.epsilon_at(0.0) == planned.epsilon_at(half_way - 1e-6) == first.epsilon
    assert planned.epsilon_at(half_way + 1e-6) == planned.epsilon_at(9.0) == second.epsilon


def refusal(robot: FiveBar, waypoints: Waypoints, **options: object) -> str:
    with pytest.raises(PlanRefused) as caught:
        plan(robot, waypoints, **options)  # type: ignore[arg-type]
    assert isinstance(caught.value, InputError)
    assert "\n" not in str(caught.value)
    return str(caught.value)


def test_a_waypoint_out_of_reach_is_refused(dextar: FiveBar) -> None:
    text = refusal(dextar, ((0.0, 0.15), (0.0, 0.18)))
    miss = (math.hypot(0.059, 0.18) - 0.18) * 1e3
    assert text == f"segment 1: (0.0000, 0.1800) m is out of reach of leg 1 by {miss:.2f} mm"
    assert "of leg 2 by" in refusal(dextar, ((0.0, 0.15), (-0.1, 0.12)))


def test_a_segment_through_the_hole_of_a_leg_is_refused(unequal_hole: FiveBar) -> None:
    """Leg 1 cannot come nearer to its motor than 25 mm; both ends of the way past it are fine."""
    text = refusal(unequal_hole, ((-0.07, 0.06), (-0.07, -0.06)))
    assert text == "segment 1: (-0.0700, 0.0000) m is out of reach of leg 1 by 25.00 mm"


@pytest.fixture(scope="module")
def unequal_hole(dextar: FiveBar) -> FiveBar:
    return dextar._replace(leg1=dextar.leg1._replace(base_x=-0.07, proximal=0.085, distal=0.11))


def test_a_segment_that_meets_type_1_is_refused(dextar: FiveBar) -> None:
    """With equal links a leg folds completely where the platform passes its motor."""
    text = refusal(dextar, ((-0.059, 0.05), (-0.059, -0.05)))
    assert "segment 1: meets the Type 1 singularity of leg 1 at (-0.0590, 0.0000) m (0.000 mm" in text
    stretched = (0.0, math.sqrt(0.18**2 - 0.059**2) - 5e-5)
    assert "meets the Type 1 singularity of leg 1 at (0.0000, 0.17" in refusal(dextar, ((0.0, 0.15), stretched))


def test_the_segment_of_a_refusal_is_counted_from_one(dextar: FiveBar) -> None:
    assert refusal(dextar, ((0.0, 0.15), (0.0, 0.13), (0.0, 0.18))).startswith("segment 2: (0.0000, 0.1800) m")


def test_a_crossing_along_the_controllable_direction_is_refused(robot: FiveBar, locus_states: States) -> None:
    """A path along v1 has its normal along t_s, in which no torque acts on the locus."""
    refused = 0
    for state in locus_states(60, 70):
        svd = parallel_svd(state)
        modes = ((-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1))
        for turn, wanted in ((0.25, math.sin(0.25)), (0.4, math.sin(0.4))):
            c, s = 0.004 * math.cos(turn), 0.004 * math.sin(turn)
            dx, dy = c * svd.v_x - s * svd.v_y, s * svd.v_x + c * svd.v_y
            waypoints = ((state.x - dx, state.y - dy), (state.x + dx, state.y + dy))
            ends = [state_from_platform(robot, modes, *waypoint, 0.0, 0.0) for waypoint in waypoints]
            if det_a(ends[0]) * det_a(ends[1]) > 0.0 or min(map(inverse_condition, ends)) < 0.001:
                continue  # it leaves the locus on the side it came from, or stays near it
            if wanted < 0.3:
                text = refusal(robot, waypoints, rule=ZoneRule(epsilon=0.0005), working_mode=modes)
                assert f"at ({state.x:.4f}, {state.y:.4f}) m" in text
                assert f"|n.v1| = {wanted:.2f}, expected at least 0.3" in text
                refused += 1
            else:
                planned = plan(robot, waypoints, rule=ZoneRule(epsilon=0.0005), working_mode=modes)
                assert planned.crossings[0].authority == pytest.approx(wanted, abs=1e-6)
    assert refused >= 5


def test_a_rest_on_the_locus_or_inside_a_zone_is_refused(dextar: FiveBar) -> None:
    inside = (0.0, LOCUS_Y - 0.004)
    kappa = inverse_condition(state_from_platform(dextar, (1, -1), *inside, 0.0, 0.0))
    text = refusal(dextar, ((0.0, 0.15), inside), rule=ZoneRule(epsilon=0.05))
    assert text.startswith("waypoint 2: a rest at (0.0000, 0.0805) m is inside the blending zone")
    assert f"1/cond(A) = {kappa:.4f}, expected at least 0.1000" in text
    plan(dextar, ((0.0, 0.15), inside), rule=ZoneRule(epsilon=0.49 * kappa))
    assert "waypoint 2" in refusal(dextar, ((0.0, 0.15), inside), rule=ZoneRule(epsilon=0.51 * kappa))


def test_a_segment_whose_zone_would_reach_everywhere_is_too_short(dextar: FiveBar) -> None:
    """1/cond(A) is 1 at most, so that no rest could be outside of the zone."""
    text = refusal(dextar, MIDDLE, duration=1e-6)
    assert text.startswith("segment 1: a duration of 1e-06 s is too short for the blending zone of the Type 2 locus")
    least = float(text.rpartition("more than ")[2].removesuffix(" s"))
    # a little slower, the zone no longer reaches everywhere, but still to the rest
    assert f"expected more than {least:g} s" in refusal(dextar, MIDDLE, duration=0.99 * least)
    assert "a rest at (0.0000, 0.1500) m is inside the blending zone" in refusal(dextar, MIDDLE, duration=1.01 * least)
    plan(dextar, MIDDLE, duration=1.01 * least, rule=ZoneRule(duration=0.02))


def test_a_law_without_zones_may_rest_in_what_would_be_one_but_not_on_the_locus(dextar: FiveBar) -> None:
    inside, rule = (0.0, LOCUS_Y - 0.004), ZoneRule(epsilon=0.05)
    plan_motion(dextar, (1, -1), ((0.0, 0.15), inside), [1.0], 500, rule, min_authority=0.0)
    with pytest.raises(PlanRefused, match=r"waypoint 2: a rest at \(0.0000, 0.0845\) m is on the Type 2 locus"):
        plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, LOCUS_Y)), [1.0], 500, rule, min_authority=0.0)


def test_a_rest_on_the_locus_is_refused_also_if_the_motion_never_crosses_it(dextar: FiveBar) -> None:
    assert "waypoint 2: a rest at (0.0000, 0.0845) m" in refusal(dextar, ((0.0, 0.15), (0.0, LOCUS_Y)))
    assert "waypoint 1: a rest at (0.0000, 0.0845) m" in refusal(dextar, ((0.0, LOCUS_Y), (0.0, 0.15)))


MALFORMED = {
    "one sign": ({"working_mode": (1,)}, "working_mode: [1]: expected two signs"),
    "no sign": ({"working_mode": (1, 0)}, "working_mode: [1, 0]: expected two signs"),
    "one waypoint": ({"waypoints": ((0.0, 0.15),)}, "waypoints: 1 given: expected at least two"),
    "NaN": ({"waypoints": ((0.0, 0.15), (math.nan, 0.12))}, "waypoint 2: (nan, 0.12): expected finite"),
    "infinite": ({"waypoints": ((0.0, math.inf), (0.0, 0.12))}, "waypoint 1: (0.0, inf): expected finite"),
    "no way": (
        {"waypoints": ((0.0, 0.15), (0.0, 0.12), (0.0, 0.12))},
        "segment 2: both ends are (0.0000, 0.1200) m: expected two different waypoints",
    ),
    "no time": ({"duration": 0.0}, "segment 1: duration 0.0 s: expected a positive number"),
    "back in time": ({"duration": -1.0}, "segment 1: duration -1.0 s: expected a positive number"),
    "NaN time": ({"duration": math.nan}, "segment 1: duration nan s: expected a positive number"),
    "endless": ({"duration": math.inf}, "segment 1: duration inf s: expected a positive number"),
    "for an hour": ({"duration": 3601.0}, "segment 1: duration 3601 s: expected at most 3600 s"),
    "rate off the grid": ({"rate_hz": 300}, "rate_hz: 300: expected a rate that divides 1e9"),
    "no rate": ({"rate_hz": 0}, "rate_hz: 0: expected"),
    "negative rate": ({"rate_hz": -500}, "rate_hz: -500: expected"),
    "no zone": ({"rule": ZoneRule(epsilon=0.0)}, "zone.epsilon: 0.0: expected a number between 0 and 0.5"),
    "everything is zone": ({"rule": ZoneRule(epsilon=0.5)}, "zone.epsilon: 0.5: expected"),
    "NaN zone": ({"rule": ZoneRule(epsilon=math.nan)}, "zone.epsilon: nan: expected"),
    "no zone time": ({"rule": ZoneRule(duration=0.0)}, "zone duration: 0.0 s: expected a positive number"),
    "NaN zone time": ({"rule": ZoneRule(duration=math.nan)}, "zone duration: nan s: expected"),
}


@pytest.mark.parametrize("kind", MALFORMED)
def test_malformed_input_is_refused_by_name(kind: str, dextar: FiveBar) -> None:
    options, expected = MALFORMED[kind]
    assert expected in refusal(dextar, **{"waypoints": MIDDLE, **options})  # type: ignore[arg-type]


def test_one_duration_per_segment_is_expected(dextar: FiveBar) -> None:
    with pytest.raises(PlanRefused, match="segment_duration: 1 given for 2 segments: expected one per segment"):
        plan_motion(dextar, OUTWARDS, MIDDLE, [1.0], 500, ZoneRule())


def test_a_place_on_an_axis_has_no_sign() -> None:
    assert place(-1e-17, -2e-5) == "(0.0000, 0.0000) m"
    assert place(-0.05, 0.15) == "(-0.0500, 0.1500) m"
