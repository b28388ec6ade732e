# SPDX-License-Identifier: Apache-2.0
"""The quickest time law: a consistent motion, little torque for its duration, the dynamic criterion on the locus."""

from __future__ import annotations

import numpy as np
import pytest

from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.predicted_run import predict_run
from fivebar_control.trajectory.criterion import criterion_residual
from fivebar_control.trajectory.optimal import POINTS, quickest_passage
from fivebar_control.trajectory.passage_torques import torques_along
from fivebar_control.trajectory.path import StraightWay
from fivebar_control.trajectory.planner import Plan, plan_motion
from fivebar_control.trajectory.refusal import PlanRefused
from fivebar_control.trajectory.time_laws import OPTIMAL, QUINTIC
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot

RATE_HZ = 500
MIDDLE = ((0.0, 0.15), (0.0, 0.02))


def planned(robot: FiveBar, duration: float, time_law: str) -> Plan:
    return plan_motion(robot, (1, -1), MIDDLE, [duration], RATE_HZ, ZoneRule(), time_law=time_law)


def torque_beyond_friction(robot: FiveBar, plan: Plan) -> float:
    """Return the largest torque (Nm) that a plan needs, 2 ms and more from the locus."""
    torques = []
    for t in np.linspace(0.0, plan.path.duration, 1001).tolist():
        if abs(t - plan.crossings[0].time) > 2e-3:
            x, y, vx, vy, ax, ay = plan.path.at(t)
            state = state_from_platform(robot, (1, -1), x, y, vx, vy)
            torques += inverse_dynamics_of_platform(robot, state, ax, ay, 0.0, 0.0)
    return float(np.max(np.abs(torques)))


def test_speed_and_acceleration_are_the_derivatives_of_the_way(dextar: FiveBar) -> None:
    law = planned(dextar, 1.0, OPTIMAL).path.straight(0).time_law
    assert (law(0.0), law(1.0)) == ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0))
    step = 1e-6
    for u in (0.01, 0.2, 0.4844, 0.6, 0.9, 0.99):
        (before, speed0, _), (_, ds, dds), (after, speed1, _) = law(u - step), law(u), law(u + step)
        assert (after - before) / (2.0 * step) == pytest.approx(ds, rel=1e-6)
        assert (speed1 - speed0) / (2.0 * step) == pytest.approx(dds, rel=1e-3, abs=1e-3)
        assert ds > 0.0


def test_it_takes_little_more_than_half_the_torque_and_meets_the_criterion(dextar: FiveBar) -> None:
    quickest, quintic = (planned(dextar, 1.0, time_law) for time_law in (OPTIMAL, QUINTIC))
    assert torque_beyond_friction(dextar, quickest) < 0.6 * torque_beyond_friction(dextar, quintic)
    crossing = quickest.crossings[0]
    there = quickest.path.at(crossing.time)
    assert abs(criterion_residual(dextar, (1, -1), there)) < 1e-6
    # what is quickest does not depend on the duration, and the torque goes with its inverse square
    half = torque_beyond_friction(dextar, planned(dextar, 0.5, OPTIMAL))
    assert half == pytest.approx(4.0 * torque_beyond_friction(dextar, quickest), rel=0.02)


@pytest.mark.parametrize(
    ("ends", "longer"),
    [(MIDDLE, 0.07), (((0.0, 0.15), (0.04, 0.03)), 0.11), (((-0.08, 0.07), (0.07, 0.06)), 0.22)],
)
def test_the_average_takes_longer_than_the_quickest_passage_under_the_same_limit(
    dextar: FiveBar, ends: tuple[tuple[float, float], ...], longer: float
) -> None:
    """docs/laws.md. Durations go with the root of the torque."""
    plan = plan_motion(dextar, (1, -1), ends, [1.0], RATE_HZ, ZoneRule(), OPTIMAL, 0.0)
    way = StraightWay(*ends[0], *ends[1])
    averaged = quickest_passage(way, torques_along(dextar, (1, -1), way, POINTS))
    assert averaged is not None
    quickest = averaged.duration / (1.0 + averaged.law.window)
    assert torque_beyond_friction(dextar, plan) ** 0.5 / quickest - 1.0 == pytest.approx(longer, abs=0.005)


@pytest.mark.parametrize(
    ("name", "ends", "crossings"),
    [("motkin", ((0.0, 0.12), (0.006, 0.008)), 1), ("dextar", ((-0.08, 0.07), (0.07, 0.06)), 2)],
    ids=["residual inertias", "two crossings"],
)
def test_it_meets_the_criterion_at_every_crossing(
    name: str, ends: tuple[tuple[float, float], ...], crossings: int
) -> None:
    robot = load_robot(name)
    plan = plan_motion(robot, (1, -1), ends, [0.8], RATE_HZ, ZoneRule(), OPTIMAL, 0.0)
    assert len(plan.crossings) == crossings
    for crossing in plan.crossings:
        there = plan.path.at(crossing.time)
        assert abs(criterion_residual(robot, (1, -1), there)) < 1e-9


@pytest.mark.extra
def test_the_predictive_law_follows_at_the_limit_of_its_torque(dextar: FiveBar) -> None:
    run = predict_run(dextar, planned(dextar, 0.35, OPTIMAL), RATE_HZ, default_tuning(CONTROLLERS["mpc"]), 1.2)
    assert run.mode_changes.value == 1.0
    assert run.torque.value < 1.2
    assert run.error.value < 2e-4


LOCALLY = {
    "to and fro": ((-1, 1), ((0.04531, -0.09016), (0.04923, -0.02665))),
    "near the end": ((1, -1), ((0.0594, -0.07452), (0.00193, -0.16664))),
}
"""Crossings where a bump over the whole way, which the middle has, restores no criterion, or goes backwards."""


@pytest.mark.parametrize(("mode", "ends"), LOCALLY.values(), ids=list(LOCALLY))
def test_where_one_bump_fails_it_is_bent_about_the_crossing_alone(
    mode: WorkingMode, ends: tuple[tuple[float, float], tuple[float, float]], dextar: FiveBar
) -> None:
    plan = plan_motion(dextar, mode, ends, [1.0], RATE_HZ, ZoneRule(), OPTIMAL, 0.0)
    (crossing,) = plan.crossings
    assert abs(criterion_residual(dextar, mode, plan.path.at(crossing.time))) < 1e-6
    law = plan.path.straight(0).time_law
    assert getattr(law.__self__, "humps")  # type: ignore[attr-defined]  # noqa: B009
    step = 1e-6
    for u in (crossing.time - 0.09, crossing.time, crossing.time + 0.05, crossing.time + 0.2):
        (before, speed0, _), (_, ds, dds), (after, speed1, _) = law(u - step), law(u), law(u + step)
        assert (after - before) / (2.0 * step) == pytest.approx(ds, rel=1e-6)
        assert (speed1 - speed0) / (2.0 * step) == pytest.approx(dds, rel=1e-3, abs=1e-3)
        assert ds > 0.0


def test_a_rest_just_before_the_locus_has_no_such_passage(dextar: FiveBar) -> None:
    with pytest.raises(PlanRefused, match="segment 1: has no passage of bounded torque"):
        plan_motion(dextar, (1, -1), ((0.0, 0.0846), (0.0, 0.02)), [1.0], RATE_HZ, ZoneRule(), OPTIMAL, 0.0)


@pytest.mark.parametrize("scale", [1e-2, 1e-5])
def test_a_light_robot_passes_as_a_heavy_one_does(scale: float, dextar: FiveBar) -> None:
    """The quickest passage is the same for torques of any size, also below the solver's tolerances."""
    legs = (leg._replace(inertia=scale * leg.inertia) for leg in (dextar.leg1, dextar.leg2))
    light = FiveBar(*legs, mass=scale * dextar.mass)
    corner = ((0.0, 0.15), (0.04, 0.13), (0.03, 0.02))
    heavy_plan, light_plan = (
        plan_motion(robot, (1, -1), corner, [0.5, 0.5], RATE_HZ, ZoneRule(), OPTIMAL, 0.0, (0.02,))
        for robot in (dextar, light)
    )
    for t in np.linspace(0.0, 1.0, 201).tolist():
        assert light_plan.path.at(t) == pytest.approx(heavy_plan.path.at(t), abs=1e-6)


def test_a_passage_is_found_whose_torques_are_at_the_edge_of_the_solvers_tolerances(dextar: FiveBar) -> None:
    points = ((0.03, 0.12), (0.03, 0.14), (0.0, 0.14))
    plan = plan_motion(dextar, (1, -1), points, [0.2, 0.2], RATE_HZ, ZoneRule(), OPTIMAL, 0.0, (0.01,))
    speeds = [np.hypot(one.vx, one.vy) for one in (plan.path.at(t) for t in np.linspace(0.05, 0.35, 61).tolist())]
    assert min(speeds) > 0.05
