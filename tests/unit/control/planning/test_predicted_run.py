# SPDX-License-Identifier: Apache-2.0
"""The predicted run: exact where nothing goes wrong, and the judge of what becomes of a motion."""

from __future__ import annotations

import math

import pytest

from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.planning.feasibility import screen, screen_run
from fivebar_control.planning.figures import (
    ERROR,
    MODE_CHANGES,
    PATH_ERROR,
    REQUEST,
    TORQUE,
    WITH_RESERVE,
    Feasibility,
    Figure,
)
from fivebar_control.planning.limits import MotionLimits, motion_limits_of
from fivebar_control.planning.predicted_run import LOST, Peak, Stretch, predict_run, stretches_of
from fivebar_control.trajectory.path_distance import PATH, TIMED
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar

RATE_HZ = 500
UNIFIED = default_tuning(CONTROLLERS["unified"]).limited_to(2.0)
GIVEN = motion_limits_of(UNIFIED, given_reach=MotionLimits().serial_margin)


def test_away_from_the_locus_the_reference_is_followed_exactly(dextar: FiveBar) -> None:
    """Only holding the torque between two samples leaves an error, which shrinks with the period."""
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.03, 0.12)), [0.5], RATE_HZ, ZoneRule())
    follower = default_tuning(CONTROLLERS["ctc"])
    errors = [predict_run(dextar, plan, rate_hz, follower, 2.0).error.value for rate_hz in (250, 500, 1000)]
    assert 0.0 < errors[2] < 0.7 * errors[1] < 0.5 * errors[0]
    assert errors[2] < 1e-4


def test_a_torque_limit_that_cannot_follow_loses_the_robot(dextar: FiveBar) -> None:
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.16), (0.0, 0.1)), [0.2], RATE_HZ, ZoneRule())
    lost = predict_run(dextar, plan, RATE_HZ, default_tuning(CONTROLLERS["ctc"]), 0.05)
    assert lost.error.value == math.inf
    assert lost.torque.value > 1.0
    # it has hardly moved when the reference is so far away
    assert plan.path.at(lost.error.time).y == pytest.approx(lost.error.y - LOST, abs=2e-3)


def test_a_rest_beyond_what_the_law_can_hold_is_refused_by_the_run_alone(dextar: FiveBar) -> None:
    """1 um before the locus: no figure of the reference is beyond its limit for the law that is regular there."""
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, 0.0845)), [1.0], RATE_HZ, ZoneRule())
    verdict = screen_run(dextar, plan, RATE_HZ, UNIFIED, GIVEN)
    assert {figure.name for figure in verdict.figures if not figure.kept} <= {ERROR, REQUEST, MODE_CHANGES}
    assert not verdict.feasible
    error = verdict.figure(ERROR)
    assert error is not None
    assert 1e-3 < error.value < 2e-3
    # 3 mm away it comes to rest where it should
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, 0.0875)), [1.0], RATE_HZ, ZoneRule())
    assert screen_run(dextar, plan, RATE_HZ, UNIFIED, GIVEN).feasible


def test_a_torque_near_the_locus_beyond_the_share_is_judged_by_the_run_without_the_reserve(dextar: FiveBar) -> None:
    """1.78 Nm for some samples displace a robot with 1.7 Nm by a third of a millimetre; 2.02 Nm by 2 mm."""
    for duration, feasible in ((0.26, True), (0.24, False)):
        plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, 0.02)), [duration], RATE_HZ, ZoneRule())
        assert [one.name for one in screen(dextar, plan, RATE_HZ, UNIFIED, MotionLimits()).figures if not one.kept] == [
            TORQUE
        ]
        verdict = screen_run(dextar, plan, RATE_HZ, UNIFIED, MotionLimits())
        assert verdict.feasible is feasible
        assert (verdict.figure(TORQUE) is None) is feasible
        run, weaker = verdict.figure(WITH_RESERVE), predict_run(dextar, plan, RATE_HZ, UNIFIED.limited_to(1.7), 1.7)
        assert run is not None and run.value == weaker.error.value


def test_a_law_that_is_late_on_its_path_is_judged_by_the_path_where_the_motion_is(dextar: FiveBar) -> None:
    """Under the path law the robot is up to 5 mm before or behind its reference, and 0.1 mm beside the path at most."""
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, 0.02)), [0.5], RATE_HZ, ZoneRule())
    follower = default_tuning(CONTROLLERS["path"]).limited_to(2.0)
    predicted = predict_run(dextar, plan, RATE_HZ, follower, 2.0, PATH)
    assert 4e-3 < predicted.error.value < 6e-3
    beside = predicted.judged
    assert beside.value < 1e-4
    assert predict_run(dextar, plan, RATE_HZ, follower, 2.0, TIMED).judged == predicted.error

    def verdict(limits: MotionLimits) -> Feasibility:
        return screen_run(dextar, plan, RATE_HZ, follower, limits)

    timed, by_path = verdict(MotionLimits()), verdict(MotionLimits(judge=PATH))
    assert [figure.name for figure in timed.figures if not figure.kept] == [ERROR]
    assert by_path.feasible
    error = by_path.figure(PATH_ERROR)
    assert error is not None
    assert (error.value, error.limit) == (beside.value, 1e-3)
    assert by_path.expected_distance == beside.value
    # the robot is stopped by its distance from the reference
    stopped = verdict(MotionLimits(judge=PATH, tracking_error=4e-3))
    assert [(figure.name, figure.limit) for figure in stopped.figures if not figure.kept] == [(ERROR, 4e-3)]


def test_at_its_end_a_motion_is_judged_by_its_goal_also_by_the_path(dextar: FiveBar) -> None:
    """With little torque the robot arrives late, on its path."""
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, 0.02)), [0.28], RATE_HZ, ZoneRule())
    weak = default_tuning(CONTROLLERS["path"]).limited_to(0.9)
    predicted = predict_run(dextar, plan, RATE_HZ, weak, 0.9, PATH)
    end = plan.path.samples(RATE_HZ)
    late = [math.hypot(one.x, one.y - 0.02) for one in predicted.moments[end:]]
    worst = predicted.judged
    assert worst.value == pytest.approx(max(late))
    assert worst.value > 5e-4
    assert worst.time == (end + late.index(max(late))) / RATE_HZ
    # on its way it was beside the path by less
    assert max(abs(one.x) for one in predicted.moments) < 0.2 * worst.value


def test_an_infeasible_reference_is_not_predicted(dextar: FiveBar) -> None:
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.05, 0.12)), [0.08], RATE_HZ, ZoneRule())
    verdict = screen_run(dextar, plan, RATE_HZ, UNIFIED, MotionLimits())
    assert not verdict.feasible
    assert verdict.figure(ERROR) is None


def test_of_a_motion_through_type_1_the_stretches_in_platform_coordinates_are_predicted(dextar: FiveBar) -> None:
    """Each in its working mode from the rest at its beginning; without such a meeting there is one stretch."""
    waypoints, modes = ((0.0, 0.15), (0.0, 0.12), (-0.06, 0.12)), ((1, -1), (1, -1), (-1, -1))
    signs = [sign for mode in modes for sign in mode]
    through = plan_motion(dextar, signs, waypoints, [0.2, 1.0], RATE_HZ, ZoneRule())
    assert stretches_of(through, RATE_HZ) == [Stretch(0, 99, (1, -1))]
    predicted = predict_run(dextar, through, RATE_HZ, UNIFIED, 2.0)
    alone = plan_motion(dextar, (1, -1), waypoints[:2], [0.2], RATE_HZ, ZoneRule())
    assert predicted.moments == predict_run(dextar, alone, RATE_HZ, UNIFIED, 2.0).moments[:100]


def test_the_first_undefined_value_is_the_largest() -> None:
    peak = Peak(1.0, 0.0, 0.0, 0.0).or_larger(math.nan, 1.0, 2.0, 3.0)
    assert peak.or_larger(9.0, 4.0, 0.0, 0.0)[1:] == (1.0, 2.0, 3.0)
    assert not Figure(ERROR, peak.value, 1.0, True, *peak[1:]).kept
