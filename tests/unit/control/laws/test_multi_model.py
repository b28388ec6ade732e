# SPDX-License-Identifier: Apache-2.0
"""The multi-model law and its sigmoid, and the trajectories that meet the dynamic criterion for it."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import cache

import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import brentq

from fivebar_control.laws.multi_model import reduced_ctc_torque
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.loop.supervisor import sigmoid_weight
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.kinematics import distal_acceleration, joint_acceleration, state_from_platform
from fivebar_control.model.state import Platform, State
from fivebar_control.trajectory.criterion import CriterionLaw, criterion_law, criterion_residual
from fivebar_control.trajectory.planner import PlanRefused, plan_motion
from fivebar_control.trajectory.time_laws import CRITERION
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar

States = Callable[[int, int], list[State]]


def modes(state: State) -> tuple[int, int]:
    return (-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1)


def test_the_reduced_law_is_computed_torque_without_the_platform(robot: FiveBar, regular_states: States) -> None:
    """With a vanishing platform mass it is exact: the motors' errors obey the linear equation."""
    light = robot._replace(mass=1e-14)
    for state in regular_states(40, 90):
        desired = Platform(state.x + 1e-4, state.y - 1e-4, state.vx, state.vy + 0.01, 1.0, 2.0)
        reference = reference_from_platform(robot, modes(state), desired)
        torque = reduced_ctc_torque(robot, state, reference, 900.0, 45.0)
        bare = reduced_ctc_torque(robot, state, reference, 0.0, 0.0)
        with_gains = direct_dynamics(light, state, *torque, reference.f1, reference.f2)[:2]
        without = direct_dynamics(light, state, *bare, reference.f1, reference.f2)[:2]
        legs = ((state.leg1, reference.state.leg1), (state.leg2, reference.state.leg2))
        for (now, wanted), after, before in zip(legs, with_gains, without, strict=True):
            feedback = 900.0 * (wanted.q1 - now.q1) + 45.0 * (wanted.dq1 - now.dq1)
            assert after - before == pytest.approx(feedback, abs=1e-6 * (1.0 + abs(after)))


@pytest.mark.parametrize("residual", [0.0, 2.0e-4])
def test_the_reduced_law_turns_the_motors_and_their_part_of_the_distal_links(
    robot: FiveBar, residual: float, regular_states: States
) -> None:
    """ZZ qddot + f - (l_1 cos q_2 / l_2) zz_2 d2 theta / dt2 for each motor, on the reference."""
    heavy = robot._replace(
        leg1=robot.leg1._replace(residual=residual), leg2=robot.leg2._replace(residual=-0.7 * residual)
    )
    for state in regular_states(10, 92):
        desired = Platform(state.x, state.y, state.vx, state.vy, 1.0, 2.0)
        reference = reference_from_platform(heavy, modes(state), desired)
        torque = reduced_ctc_torque(heavy, state, reference, 900.0, 45.0)
        legs = (heavy.leg1, state.leg1, reference.f1), (heavy.leg2, state.leg2, reference.f2)
        expected = [
            leg.inertia * joint_acceleration(at, 1.0, 2.0)
            + friction
            - leg.proximal * at.cos_q2 / leg.distal * leg.residual * distal_acceleration(leg, at, 1.0, 2.0)
            for leg, at, friction in legs
        ]
        assert torque == pytest.approx(expected, rel=1e-12, abs=1e-14)


def test_the_reduced_law_is_finite_on_the_locus(robot: FiveBar, locus_states: States) -> None:
    for state in locus_states(20, 91):
        desired = Platform(state.x, state.y, state.vx, state.vy, 1.0, 2.0)
        reference = reference_from_platform(robot, modes(state), desired)
        assert all(math.isfinite(value) for value in reduced_ctc_torque(robot, state, reference, 900.0, 45.0))


@pytest.mark.parametrize(
    ("t", "weight"),
    [(0.9, 0.0), (0.95, 0.0), (0.9625, 0.5), (0.975, 1.0), (1.0, 1.0), (1.025, 1.0), (1.0375, 0.5), (1.05, 0.0)],
)
def test_the_sigmoid_is_one_for_its_duration_and_gone_after_twice_of_it(t: float, weight: float) -> None:
    assert sigmoid_weight(t, [1.0, 3.0], 0.05) == pytest.approx(weight, abs=1e-9)
    assert sigmoid_weight(t + 2.0, [1.0, 3.0], 0.05) == pytest.approx(weight, abs=1e-9)


def test_without_crossings_the_full_model_is_used() -> None:
    assert sigmoid_weight(0.3, [], 0.05) == 0.0


WAYS = (0.01, 0.1, 0.3, 0.49, 0.499, 0.4999, 0.5 - 1e-9, 0.5, 0.5 + 1e-7, 0.5038, 0.6, 0.9, 0.99)
"""Fractions of the way at which the locus may lie; half of it is where the equations are singular."""


@cache
def law_through(s_crossing: float) -> CriterionLaw:
    law = criterion_law(s_crossing)
    assert law is not None
    return law


@given(s_crossing=st.sampled_from(WAYS), u=st.floats(0.001, 0.999))
def test_a_criterion_law_is_a_rest_to_rest_motion_with_true_derivatives(s_crossing: float, u: float) -> None:
    law = law_through(s_crossing)
    assert law(0.0) == (0.0, 0.0, 0.0)
    assert law(1.0) == (1.0, 0.0, 0.0)
    assert law(1.0 - 1e-9) == pytest.approx((1.0, 0.0, 0.0), abs=1e-6)
    h = 1e-6
    (before, before_rate, _), (_, rate, bend), (after, after_rate, _) = law(u - h), law(u), law(u + h)
    assert rate == pytest.approx((after - before) / (2.0 * h), abs=1e-7)
    assert bend == pytest.approx((after_rate - before_rate) / (2.0 * h), abs=1e-6)
    assert rate >= -1e-9


@pytest.mark.parametrize("s_crossing", WAYS)
def test_a_criterion_law_passes_its_crossing_without_acceleration(s_crossing: float) -> None:
    law = law_through(s_crossing)
    u = brentq(lambda u: law(u)[0] - s_crossing, 0.0, 1.0, xtol=1e-15)
    _, rate, bend = law(u)
    peak = max(abs(law(step / 1000.0)[2]) for step in range(1001))
    assert abs(bend) < 1e-5 * peak
    assert rate > 0.05


@pytest.mark.parametrize("rho", [0.5, -2.0, 5.0, 9.0, -12.0, 40.0])
def test_a_criterion_law_has_the_acceleration_that_its_crossing_asks_for(rho: float) -> None:
    """Also where motions almost across t_s ask for much."""
    law = criterion_law(0.45, rho)
    assert law is not None
    u = brentq(lambda u: law(u)[0] - 0.45, 0.0, 1.0, xtol=1e-15)
    _, rate, bend = law(u)
    assert bend == pytest.approx(rho * rate**2, rel=1e-6)
    assert min(law(step / 1000.0)[1] for step in range(1001)) > -1e-6


def test_criterion_laws_near_half_way_are_all_nearly_the_same() -> None:
    """Their peak acceleration is below the 10 / sqrt(3) of the fifth-order polynomial, which is one of them."""
    for s_crossing in (0.495, 0.499, 0.4999, 0.5 - 1e-7, 0.5, 0.5 + 1e-9, 0.5001, 0.505):
        law = law_through(s_crossing)
        peak = max(abs(law(step / 1000.0)[2]) for step in range(1001))
        assert 5.6 < peak < 10.0 / math.sqrt(3.0)


def test_criterion_laws_are_mirror_images() -> None:
    for s_crossing in (0.1, 0.3, 0.45):
        one, other = law_through(s_crossing), law_through(1.0 - s_crossing)
        for u in (0.1, 0.4, 0.7):
            assert one(u)[0] == pytest.approx(1.0 - other(1.0 - u)[0], abs=1e-4)


def test_a_crossing_at_the_very_end_has_no_criterion_law() -> None:
    assert criterion_law(1e-4) is None
    assert criterion_law(1.0 - 1e-4) is None


def test_a_planned_crossing_at_the_very_end_is_refused_with_its_place(dextar: FiveBar) -> None:
    start = math.sqrt(0.0081 - 0.000961) + 1e-5
    waypoints = ((0.0, start), (0.0, start - 0.1))
    with pytest.raises(PlanRefused, match="segment 1: crosses the Type 2 locus after 0% of its way: no polynomial"):
        plan_motion(dextar, (1, -1), waypoints, [1.0], 500, ZoneRule(epsilon=1e-6), CRITERION)


def test_a_planned_motion_meets_the_criterion_at_every_crossing(dextar: FiveBar) -> None:
    """The thesis' polynomials, which know nothing of the locus, do not."""
    waypoints = ((0.0, 0.15), (0.0, 0.035), (0.0, 0.15), (0.025, 0.025))
    durations = [1.0, 0.7, 1.3]
    careful = plan_motion(dextar, (1, -1), waypoints, durations, 500, ZoneRule(), CRITERION)
    careless = plan_motion(dextar, (1, -1), waypoints, durations, 500, ZoneRule())
    assert len(careful.crossings) == len(careless.crossings) == 3
    for crossing in careful.crossings:
        residual = criterion_residual(dextar, (1, -1), careful.path.at(crossing.time))
        assert abs(residual) < 1e-6
    residuals = [abs(criterion_residual(dextar, (1, -1), careless.path.at(one.time))) for one in careless.crossings]
    assert min(residuals) > 0.01
    for planned in (careful, careless):
        assert planned.path.at(planned.path.duration)[:2] == pytest.approx((0.025, 0.025), abs=1e-15)


def test_the_residual_is_the_force_along_t_s(dextar: FiveBar) -> None:
    """Level distal links leave the y direction uncontrollable."""
    y = math.sqrt(0.0081 - 0.000961)
    residual = criterion_residual(dextar, (1, -1), Platform(0.0, y, 0.0, -0.3, 5.0, -2.0))
    assert abs(residual) == pytest.approx(0.537 * 2.0, rel=1e-12)
    state = state_from_platform(dextar, (1, -1), 0.0, y, 0.0, -0.3)
    free = direct_dynamics(dextar, state, 1.3, -0.4, 0.1, 0.2)
    assert criterion_residual(dextar, (1, -1), Platform(0.0, y, 0.0, -0.3, free.ax, free.ay)) == pytest.approx(
        0.0, abs=1e-12
    )


def test_a_segment_that_crosses_twice_cannot_meet_the_criterion(dextar: FiveBar) -> None:
    waypoints, rule = ((-0.037, -0.024), (0.049, -0.013)), ZoneRule(epsilon=0.01)
    assert len(plan_motion(dextar, (1, -1), waypoints, [1.0], 500, rule).crossings) == 2
    with pytest.raises(PlanRefused, match="segment 1: crosses the Type 2 locus 2 times: expected at most one"):
        plan_motion(dextar, (1, -1), waypoints, [1.0], 500, rule, CRITERION)
