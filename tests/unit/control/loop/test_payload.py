# SPDX-License-Identifier: Apache-2.0
"""A payload on the platform: law, guard and estimator go on as those of a robot with that mass do."""

from __future__ import annotations

import pytest

from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.homing import homing_at
from fivebar_control.estimation.settings import Drives, EkfSettings, Sensing
from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.loop.law_runner import LawRunner
from fivebar_control.loop.plan_sample import planned_references
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.planning.order_planning import plan_order
from fivebar_control.planning.orders import Conditions, PlanningRequest
from fivebar_control.safety.guard import Guard
from fivebar_control.safety.settings import SafetySettings
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar, laden

RATE = 500


def test_the_law_asks_for_the_torque_of_the_heavier_robot(dextar: FiveBar) -> None:
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, 0.12)), (0.2,), RATE, ZoneRule())
    law = default_tuning(CONTROLLERS["unified"]).nominal
    heavy = laden(dextar, 0.5)
    runner, wanted = LawRunner(law, dextar, plan, RATE), LawRunner(law, heavy, plan, RATE)
    here = planned_references(plan, RATE)[20]
    state = state_from_platform(heavy, (1, -1), here.x, here.y, here.vx, here.vy)
    reference = desired_at(heavy, plan, 20 / RATE, here)
    runner.carry(heavy)
    assert runner(20, state, reference) == wanted(20, state, reference)
    assert LawRunner(law, dextar, plan, RATE)(20, state, reference) != wanted(20, state, reference)


def test_the_guard_and_the_estimator_know_of_it(dextar: FiveBar) -> None:
    heavy = laden(dextar, 0.5)
    guard, wanted_guard = (Guard(robot, (1, -1), RATE, SafetySettings()) for robot in (dextar, heavy))
    guard.carry(heavy)
    moving = state_from_platform(dextar, (1, -1), 0.0, 0.13, 0.1, -0.2)
    for one in (guard, wanted_guard):
        one._braking = 5
    assert guard.stop(moving) == wanted_guard.stop(moving)
    q11, _, q21, _ = inverse_geometry(dextar, (1, -1), 0.0, 0.13)
    estimates = []
    for robot, carried in ((dextar, heavy), (heavy, heavy), (dextar, dextar)):
        estimator = StateEstimator(robot, homing_at(dextar, (1, -1), 0.0, 0.13), Sensing(RATE, Drives(), EkfSettings()))
        estimator.carry(carried)
        estimator.take(0, q11, q21, 0.0, 0.0)
        estimates.append(estimator.take(1, q11, q21, 0.8, -0.5))
    assert estimates[0] == estimates[1] != estimates[2]


@pytest.mark.parametrize("other", [{"payload": 0.5}, {"torque_share": 0.5}, {"speed_share": 0.02}], ids=str)
def test_the_planner_takes_longer_for_more_mass_and_for_less_of_the_limits(other: dict[str, float]) -> None:
    conditions = Conditions("dextar", 100, 2.0, 50.0)
    order = PlanningRequest((0.0, 0.15), (1, -1), (0.0, 0.14), 0, 0.0)
    assert sum(plan_order(conditions, order._replace(**other)).durations) > sum(plan_order(conditions, order).durations)
