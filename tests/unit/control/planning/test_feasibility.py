# SPDX-License-Identifier: Apache-2.0
"""The feasibility screen: each figure against another way to find it, and every limit's refusal."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.law import TunedLaw
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.laws.registry import CONTROLLERS, TunedController, default_tuning
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.planning.feasibility import screen
from fivebar_control.planning.figures import (
    APPROACH,
    DIRECTION,
    DWELL,
    NEAREST,
    REST,
    SERIAL,
    SPEED,
    TORQUE,
    ZONE_STAY,
    Feasibility,
    Figure,
)
from fivebar_control.planning.limits import MotionLimits, exceeded_share, motion_limits_of, reach_within, speed_step_of
from fivebar_control.planning.reference_scan import ReferenceTorque, dwells_near_locus
from fivebar_control.planning.risk import Risk
from fivebar_control.trajectory.planner import Plan, plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.loads import Loads
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import Tolerances

RATE_HZ = 500
BLENDED = default_tuning(CONTROLLERS["multi_cartesian"])
UNIFIED = default_tuning(CONTROLLERS["unified"])
CHOSEN_REACH = MotionLimits().serial_margin
MIDDLE = ((0.0, 0.15), (0.0, 0.02))


def planned(robot: FiveBar, *waypoints: tuple[float, float], duration: float = 1.0) -> Plan:
    return plan_motion(robot, (1, -1), waypoints, [duration] * (len(waypoints) - 1), RATE_HZ, ZoneRule())


def figure(verdict: Feasibility, name: str) -> Figure:
    found = verdict.figure(name)
    assert found is not None
    return found


def dense(robot: FiveBar, plan: Plan, steps: int) -> list[tuple[float, float]]:
    """Return time and kappa, many times."""
    found = []
    for t in np.linspace(0.0, plan.path.duration, steps + 1).tolist():
        p = plan.path.at(t)
        found.append((t, inverse_condition(state_from_platform(robot, (1, -1), p.x, p.y, p.vx, p.vy))))
    return found


@pytest.mark.parametrize("follower", [UNIFIED, BLENDED], ids=["unified", "blended"])
def test_off_the_locus_the_torque_is_what_pinocchio_needs(dextar: FiveBar, follower: TunedController) -> None:
    """Put into Pinocchio's robot it gives the reference's acceleration; its peak is that of all samples."""
    plan = planned(dextar, (0.0, 0.15), (0.05, 0.12), duration=0.3)
    needed = ReferenceTorque(dextar, plan, RATE_HZ, follower)
    loop = ClosedLoop(dextar)
    peak = 0.0
    for sample in range(plan.path.samples(RATE_HZ) + 1):
        p = plan.path.at(sample / RATE_HZ)
        reference = reference_from_platform(dextar, (1, -1), p)
        leg1, leg2 = reference.state.leg1, reference.state.leg2
        torque = needed(sample, reference)
        q = np.array([leg1.q1, leg1.q2, leg2.q1, leg2.q2])
        v = np.array([leg1.dq1, leg1.dtheta - leg1.dq1, leg2.dq1, leg2.dtheta - leg2.dq1])
        applied = np.array([torque.tau1 - reference.f1, 0.0, torque.tau2 - reference.f2, 0.0])
        got = loop.platform(q, v, loop.acceleration(q, v, applied))[2]
        assert got == pytest.approx((p.ax, p.ay), abs=1e-8)
        peak = max(peak, abs(torque.tau1), abs(torque.tau2))
    verdict = screen(dextar, plan, RATE_HZ, follower, MotionLimits())
    assert figure(verdict, TORQUE).value == pytest.approx(peak, rel=1e-12)


def test_on_the_locus_the_torque_is_finite(dextar: FiveBar) -> None:
    """Inverse dynamics would ask for hundreds of Nm: not half way, the reference accelerates on the locus."""
    plan = planned(dextar, (0.0, 0.15), (0.0, 0.05))
    for follower in (UNIFIED, BLENDED):
        assert figure(screen(dextar, plan, RATE_HZ, follower, MotionLimits()), TORQUE).value < 1.0
    assert figure(screen(dextar, plan, RATE_HZ, default_tuning(CONTROLLERS["ctc"]), MotionLimits()), TORQUE).value > 5.0


def test_the_stay_near_the_locus_equals_dense_sampling(dextar: FiveBar) -> None:
    plan = planned(dextar, *MIDDLE, duration=4.0)
    seen = [t for t, kappa in dense(dextar, plan, 80_000) if kappa < 0.05]
    ((start, end),) = dwells_near_locus(dextar, plan, RATE_HZ)
    assert (start, end) == pytest.approx((seen[0], seen[-1]), abs=1e-4)
    # to first order kappa grows from 0 with the rate at the crossing
    assert end - start == pytest.approx(2.0 * 0.05 / plan.crossings[0].kappa_rate, rel=0.02)
    assert figure(screen(dextar, plan, RATE_HZ, UNIFIED, MotionLimits()), DWELL).value == pytest.approx(end - start)


def test_the_stay_grows_with_the_duration_and_has_a_limit(dextar: FiveBar) -> None:
    stays = [
        figure(screen(dextar, planned(dextar, *MIDDLE, duration=T), RATE_HZ, UNIFIED, MotionLimits()), DWELL)
        for T in (1.0, 2.0, 6.0)
    ]
    assert stays[1].value == pytest.approx(2.0 * stays[0].value, rel=1e-4)
    assert [stay.kept for stay in stays] == [True, True, False]


def test_a_near_miss_counts_as_a_stay(dextar: FiveBar) -> None:
    """Along y = 0.088 m the platform passes 3.5 mm above the locus and does not cross it."""
    plan = planned(dextar, (-0.03, 0.1), (-0.001, 0.0878), (0.03, 0.1), duration=1.0)
    assert plan.crossings == ()
    verdict = screen(dextar, plan, RATE_HZ, UNIFIED, MotionLimits())
    assert not verdict.feasible
    assert not figure(verdict, REST).kept
    assert not figure(verdict, DWELL).kept
    assert len(dwells_near_locus(dextar, plan, RATE_HZ)) == 1


@pytest.mark.parametrize("height", [0.0845, 0.0847, 0.085, 0.09])
def test_the_nearest_pass_equals_dense_sampling(dextar: FiveBar, height: float) -> None:
    """Beside the locus without crossing it, from 1 um on; no sample of the controllers need be there."""
    plan = planned(dextar, (-0.03, height), (0.035, height), duration=0.4)
    assert plan.crossings == ()
    kappa, t = min((kappa, t) for t, kappa in dense(dextar, plan, 40_000))
    for follower in (default_tuning(CONTROLLERS["ctc"]), BLENDED):
        found = figure(screen(dextar, plan, RATE_HZ, follower, MotionLimits()), NEAREST)
        assert found.value == pytest.approx(kappa, abs=1e-6)
        assert found.time == pytest.approx(t, abs=1e-4)
        assert found.kept == (height > 0.0855)
    # the law that is regular there is judged by what it asks for
    assert screen(dextar, plan, RATE_HZ, UNIFIED, MotionLimits()).figure(NEAREST) is None


def test_a_crossing_is_a_nearest_pass_unless_a_constraint_law_acts(dextar: FiveBar) -> None:
    plan = planned(dextar, *MIDDLE)
    found = figure(screen(dextar, plan, RATE_HZ, default_tuning(CONTROLLERS["ctc"]), MotionLimits()), NEAREST)
    assert found.value < 1e-5
    assert found.time == pytest.approx(plan.crossings[0].time, abs=1e-5)
    assert screen(dextar, plan, RATE_HZ, BLENDED, MotionLimits()).figure(NEAREST) is None


def test_given_motions_are_judged_by_what_they_ask_for() -> None:
    assert motion_limits_of(UNIFIED, given_reach=CHOSEN_REACH).dwell == math.inf
    assert motion_limits_of(UNIFIED, given_reach=CHOSEN_REACH).rest == 0.0
    step = 2.0 * math.pi * RATE_HZ / 20_000
    for follower in (UNIFIED, BLENDED):
        given = motion_limits_of(follower, speed_step=step, given_reach=CHOSEN_REACH)
        assert given == motion_limits_of(follower, speed_step=step)


def test_with_encoders_a_leg_that_is_shorter_by_its_tolerances_must_reach(dextar: FiveBar) -> None:
    step = 2.0 * math.pi * RATE_HZ / 20_000
    sine = reach_within(dextar, Tolerances(length=5e-5, base=4e-5))
    leg = dextar.leg1
    lengths = leg.proximal, leg.distal
    stretched = math.sqrt(lengths[0] ** 2 + lengths[1] ** 2 + 2.0 * lengths[0] * lengths[1] * math.sqrt(1.0 - sine**2))
    assert sum(lengths) - stretched == pytest.approx(1.4e-4, rel=1e-9)
    assert motion_limits_of(UNIFIED, speed_step=step, given_reach=sine).serial_margin == sine
    chosen = motion_limits_of(BLENDED, speed_step=step)
    assert motion_limits_of(BLENDED, speed_step=step, given_reach=sine) == chosen
    # undeclared and coarse tolerances leave the margin of a chosen motion
    assert {reach_within(dextar, Tolerances(length=one)) for one in (0.0, 1e-3)} == {chosen.serial_margin}


def test_the_exceeded_share_of_a_load_is_that_of_random_loads() -> None:
    random = np.random.default_rng(0)
    along = random.uniform(0.0, 1.0, 400_000) * np.abs(np.cos(random.uniform(0.0, math.pi, 400_000)))
    for probability in (0.05, 0.3, 0.5):
        assert np.mean(along > exceeded_share(probability)) == pytest.approx(probability, abs=5e-3)
    assert exceeded_share(0.0) == pytest.approx(1.0)
    loads = Loads(tilt=0.02, push=1.0, passive=0.003)
    risked = MotionLimits(loads=loads, risk=Risk(load=0.3)).certain_loads
    assert risked.push == pytest.approx(exceeded_share(0.3)) and risked.passive == loads.passive
    assert MotionLimits(loads=loads).certain_loads == pytest.approx(loads)


def test_the_type_1_margin_is_that_of_the_cosine_rule(dextar: FiveBar) -> None:
    """From the distance to the base: d^2 = 2 l^2 (1 + cos q2)."""
    far = (-0.04, -0.145)
    plan = planned(dextar, (-0.05, -0.11), far)
    distance_squared = (far[0] - 0.059) ** 2 + far[1] ** 2
    cosine = distance_squared / (2.0 * 0.09**2) - 1.0
    found = figure(screen(dextar, plan, RATE_HZ, UNIFIED, MotionLimits(serial_margin=0.3)), SERIAL)
    assert found.value == pytest.approx(math.sqrt(1.0 - cosine**2), rel=1e-9)
    assert (found.x, found.y) == pytest.approx(far)


def test_the_motor_speed_is_that_of_the_difference_quotient(dextar: FiveBar) -> None:
    plan = planned(dextar, *MIDDLE, duration=0.8)
    step = 1e-5
    largest = 0.0
    for t in np.linspace(0.0, 0.8, 4001).tolist():
        before, after = plan.path.at(t - step), plan.path.at(t + step)
        one = state_from_platform(dextar, (1, -1), before.x, before.y, 0.0, 0.0)
        other = state_from_platform(dextar, (1, -1), after.x, after.y, 0.0, 0.0)
        largest = max(
            largest,
            abs(other.leg1.q1 - one.leg1.q1) / (2.0 * step),
            abs(other.leg2.q1 - one.leg2.q1) / (2.0 * step),
        )
    found = figure(screen(dextar, plan, RATE_HZ, UNIFIED, MotionLimits()), SPEED)
    assert found.value == pytest.approx(largest, rel=1e-4)


@pytest.mark.parametrize(
    ("tightened", "name"),
    [
        (MotionLimits(torque=0.3), TORQUE),
        (MotionLimits(motor_speed=0.5), SPEED),
        (MotionLimits(serial_margin=0.9), SERIAL),
        (MotionLimits(rest=0.9), REST),
        (MotionLimits(dwell=0.01), DWELL),
        (MotionLimits(zone_stay=0.05), ZONE_STAY),
        (MotionLimits(authority=1.1), DIRECTION),
    ],
)
def test_every_limit_refuses_by_itself_and_says_where(dextar: FiveBar, tightened: MotionLimits, name: str) -> None:
    plan = planned(dextar, *MIDDLE)
    assert screen(dextar, plan, RATE_HZ, BLENDED, MotionLimits()).reasons == []
    (reason,) = screen(dextar, plan, RATE_HZ, BLENDED, tightened).reasons
    assert reason.startswith(f"{name} is ")
    assert "m after" in reason
    assert "expected at" in reason


def test_the_rests_of_a_blended_controller_keep_twice_the_edge_of_its_widest_zone(dextar: FiveBar) -> None:
    """The law without switching has no zones."""
    waypoints = ((0.0, 0.15), (0.0, 0.035), (0.01, 0.035), (0.01, 0.15))
    plan = plan_motion(dextar, (1, -1), waypoints, (0.5, 0.5, 2.0), RATE_HZ, ZoneRule())
    wide, narrow = (2.0 * crossing.epsilon for crossing in plan.crossings)
    assert wide > 2.0 * narrow
    for follower, room in ((BLENDED, 2.0), (UNIFIED, 0.0)):
        limits = (
            figure(screen(dextar, plan, RATE_HZ, follower, MotionLimits(rest=rest)), REST).limit for rest in (0.0, 0.9)
        )
        assert tuple(limits) == pytest.approx((room * wide, 0.9), rel=1e-12)


def test_no_rest_has_to_be_farther_than_a_kappa_can_be(dextar: FiveBar) -> None:
    """At a low rate a zone is wide: the rest is then half way from its edge to 1."""
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, 0.02)), [1.0], 50, ZoneRule())
    edge = 2.0 * plan.crossings[0].epsilon
    assert edge > 0.5
    limit = figure(screen(dextar, plan, 50, BLENDED, MotionLimits()), REST).limit
    assert limit == pytest.approx(0.5 * (edge + 1.0), rel=1e-12)


@pytest.mark.parametrize(("torque", "share", "most"), [(2.0, 0.85, 1.7), (4.0, 0.5, 2.0)])
def test_the_reference_may_take_its_share_of_the_torque(
    dextar: FiveBar, torque: float, share: float, most: float
) -> None:
    verdict = screen(
        dextar, planned(dextar, *MIDDLE), RATE_HZ, UNIFIED, MotionLimits(torque=torque, torque_share=share)
    )
    assert figure(verdict, TORQUE).limit == pytest.approx(most, rel=1e-12)


def test_a_crossing_between_two_samples_is_a_stay(dextar: FiveBar) -> None:
    """At 25 Hz no sample sees the locus: it is passed in half a period."""
    plan = plan_motion(dextar, (1, -1), MIDDLE, [0.52], 25, ZoneRule(epsilon=0.05))
    (crossing,) = plan.crossings
    for sample in range(plan.path.samples(25) + 1):
        p = plan.path.at(sample / 25)
        assert inverse_condition(state_from_platform(dextar, (1, -1), p.x, p.y, p.vx, p.vy)) > 0.05
    (dwell,) = dwells_near_locus(dextar, plan, 25)
    assert dwell.start < crossing.time < dwell.end
    assert dwell.end - dwell.start == pytest.approx(2.0 * 0.05 / crossing.kappa_rate, rel=0.02)


@pytest.mark.parametrize("leg", [1, 2])
def test_a_speed_that_is_unknown_of_either_motor_is_not_feasible(dextar: FiveBar, leg: int) -> None:
    """A plan for another robot, one leg of which does not reach: the speed of the other must not stand for both."""
    plan = planned(dextar, (0.0, 0.15), (0.05, 0.12))
    one, two = (
        parameters._replace(distal=0.06) if number == leg else parameters
        for number, parameters in enumerate((dextar.leg1, dextar.leg2), start=1)
    )
    robot = dextar._replace(leg1=one, leg2=two)
    state = state_from_platform(robot, (1, -1), 0.0, 0.15, 0.0, 0.0)
    assert math.isnan(state.leg1.dq1) == (leg == 1)
    assert math.isnan(state.leg2.dq1) == (leg == 2)
    found = figure(screen(robot, plan, RATE_HZ, UNIFIED, MotionLimits()), SPEED)
    assert math.isnan(found.value)
    assert not found.kept


def test_only_blended_controllers_need_a_direction(dextar: FiveBar) -> None:
    plan = planned(dextar, *MIDDLE)
    assert screen(dextar, plan, RATE_HZ, UNIFIED, MotionLimits()).figure(DIRECTION) is None
    assert figure(screen(dextar, plan, RATE_HZ, BLENDED, MotionLimits()), DIRECTION).value == pytest.approx(1.0)


def test_a_blended_controller_needs_a_steady_passage(dextar: FiveBar) -> None:
    """Straight through the locus the zone lasts twice its duration; along the locus first, it lasts longer."""
    straight = screen(dextar, planned(dextar, *MIDDLE), RATE_HZ, BLENDED, MotionLimits())
    assert figure(straight, ZONE_STAY).value == pytest.approx(0.08, rel=0.05)
    along = plan_motion(dextar, (-1, -1), ((0.078, 0.0296), (-0.091, -0.03)), (1.152,), RATE_HZ, ZoneRule())
    assert along.crossings
    verdict = screen(dextar, along, RATE_HZ, BLENDED, MotionLimits())
    assert not figure(verdict, ZONE_STAY).kept


def test_an_undefined_torque_is_not_feasible(dextar: FiveBar) -> None:
    assert not Figure(TORQUE, math.nan, 1.7, True, 0.0, 0.0, 0.0).kept
    assert not Figure(REST, math.nan, 0.05, False, 0.0, 0.0, 0.0).kept


def test_blended_controllers_need_quicker_crossings_with_coarse_encoders() -> None:
    step = 2.0 * math.pi * RATE_HZ / 20_000
    assert motion_limits_of(UNIFIED) == MotionLimits()
    # an estimator gives up after 0.2 s, and errors of its velocity turn the motors faster than the reference
    assert motion_limits_of(UNIFIED, speed_step=step) == MotionLimits()._replace(
        dwell=0.15, approach=5.0, speed_share=0.8
    )
    assert motion_limits_of(BLENDED, speed_step=step).dwell < motion_limits_of(BLENDED).dwell == 0.2
    assert motion_limits_of(BLENDED).rest > MotionLimits().rest


@pytest.mark.parametrize(("kp", "least"), [(2500.0, 0.1), (6400.0, 0.0625)])
def test_with_encoders_the_feedback_has_time_to_settle_between_a_rest_and_the_locus(
    dextar: FiveBar, kp: float, least: float
) -> None:
    """Five time constants 1 / sqrt(kp) on the shorter side; with exact sensors as quick as the motors can."""
    law = CONTROLLERS["unified"].nominal
    follower = TunedController(CONTROLLERS["unified"], TunedLaw(law, UnifiedSettings(kp=kp, kd=2.0 * math.sqrt(kp))))
    sensed = motion_limits_of(follower, torque=math.inf, speed_step=speed_step_of(RATE_HZ, 20_000))
    found = []
    for duration in (0.15, 0.5):
        plan = plan_motion(
            dextar, (1, -1), ((0.0, 0.15), (0.0, 0.05)), [duration], RATE_HZ, ZoneRule(), min_authority=0.0
        )
        (crossing,) = plan.crossings
        figure = screen(dextar, plan, RATE_HZ, follower, sensed).figure(APPROACH)
        assert figure is not None
        assert figure.value == min(crossing.time, duration - crossing.time)
        assert figure.limit == pytest.approx(least, rel=1e-12)
        assert screen(dextar, plan, RATE_HZ, follower, motion_limits_of(follower)).figure(APPROACH) is None
        found.append(figure.kept)
    assert found == [False, True]
