# SPDX-License-Identifier: Apache-2.0
"""The predictive law: quadratic programs solved exactly within the limits, and crossings ten times as close."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_control.laws import mpc, mpc_problem
from fivebar_control.laws.law import Instant, TunedLaw
from fivebar_control.laws.mpc import LAW, MpcMemory, MpcSettings, unified_settings
from fivebar_control.laws.mpc_problem import FloatArray, QuadraticProgram, Solution, compiled_problem_of, solve
from fivebar_control.laws.reference import against_disturbance, reference_from_platform
from fivebar_control.laws.registry import CONTROLLERS, TunedController, default_tuning
from fivebar_control.laws.unified import unified_step
from fivebar_control.loop.plan_sample import reference_ahead
from fivebar_control.model.line import Line
from fivebar_control.planning.predicted_run import predict_run
from fivebar_control.trajectory.planner import Plan, plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import as_numbers

RATE_HZ = 500
WAYPOINTS = ((0.0, 0.15), (0.0, 0.02))


def middle(robot: FiveBar, duration: float) -> Plan:
    return plan_motion(robot, (1, -1), WAYPOINTS, [duration], RATE_HZ, ZoneRule())


def instant_at(robot: FiveBar, plan: Plan, sample: int, offset: float = 0.0) -> Instant:
    """Return a sample of the plan, with the robot off its reference by `offset` (m) along x."""
    reference = reference_from_platform(robot, (1, -1), plan.path.at(sample / RATE_HZ))
    desired = reference.state
    moved = plan.path.at(sample / RATE_HZ)._replace(x=desired.x + offset)
    ahead = reference_ahead(plan, sample, RATE_HZ, MpcSettings().horizon)
    line = Line(desired.x, desired.y, 0.0, -1.0)
    state = reference_from_platform(robot, (1, -1), moved).state
    return Instant(state, reference, line, (1, -1), 0.0, 1.0 / RATE_HZ, ahead)


def crossing_sample(plan: Plan) -> int:
    return round(plan.crossings[0].time * RATE_HZ)


@pytest.fixture
def solved(monkeypatch: pytest.MonkeyPatch) -> list[QuadraticProgram]:
    """The problems that the law gives to the solver."""
    problems: list[QuadraticProgram] = []

    def watched(problem: QuadraticProgram, duals: FloatArray | None, unit: float) -> Solution:
        problems.append(problem)
        return solve(problem, duals, unit)

    monkeypatch.setattr(mpc, "solve", watched)
    return problems


def test_a_step_compiles_nothing_beyond_what_the_warm_up_has(dextar: FiveBar) -> None:
    LAW.warm_up()
    compiled = compiled_problem_of()
    assert len(compiled.signatures) == 1
    plan = middle(dextar, 1.0)
    for settings in (MpcSettings(), MpcSettings(torque_limit=2.0, torque_rate_limit=60.0)):
        memory = LAW.memory
        for sample in range(2):
            torque, memory = LAW.step(dextar, instant_at(dextar, plan, sample), memory, as_numbers(settings))
            assert math.isfinite(torque.tau1)
            assert memory.unfinished == 0
    assert len(compiled.signatures) == 1


def test_the_fast_crossing_is_within_a_fiftieth_of_a_millimetre_for_the_torque_of_unified(dextar: FiveBar) -> None:
    plan = middle(dextar, 0.5)
    ours, other = (
        predict_run(dextar, plan, RATE_HZ, default_tuning(CONTROLLERS[name]), 2.0) for name in ("mpc", "unified")
    )
    assert ours.error.value < 2e-5 < other.error.value
    assert ours.torque.value < 1.15 * other.torque.value
    assert ours.mode_changes.value == 1.0


def test_crossings_beside_the_axis_are_as_near_for_no_more_torque(dextar: FiveBar) -> None:
    """From the axis to the left of it, and back into the other mode."""
    places = ((0.0, 0.15), (-0.025, 0.025), (-0.025, 0.125))
    plan = plan_motion(dextar, (1, -1), places, [0.5, 0.5], RATE_HZ, ZoneRule())
    ours, other = (
        predict_run(dextar, plan, RATE_HZ, default_tuning(CONTROLLERS[name]), 2.0) for name in ("mpc", "unified")
    )
    assert ours.error.value < 2e-5 < other.error.value
    assert ours.torque.value < 1.15 * other.torque.value
    assert ours.mode_changes.value == 2.0


def test_both_limits_are_kept_to_the_last_bit_of_the_request(dextar: FiveBar) -> None:
    plan, limit, rate = middle(dextar, 0.5), 0.8, 40.0
    follower = TunedController(
        CONTROLLERS["mpc"], TunedLaw(LAW, MpcSettings(torque_limit=limit, torque_rate_limit=rate))
    )
    run = predict_run(dextar, plan, RATE_HZ, follower, math.inf)
    torques = np.array([(one.tau1, one.tau2) for one in run.moments])
    assert run.mode_changes.value == 1.0
    assert np.max(np.abs(torques)) == limit
    # the sum of the last torque and a step rounds
    assert np.max(np.abs(np.diff(torques, axis=0))) == pytest.approx(rate / RATE_HZ, abs=1e-15)
    assert run.error.value < 1e-3


def test_the_solution_meets_the_conditions_of_optimality(dextar: FiveBar, solved: list[QuadraticProgram]) -> None:
    plan = middle(dextar, 0.5)
    settings = as_numbers(MpcSettings(torque_limit=0.6, torque_rate_limit=20.0))
    memory: MpcMemory = LAW.memory
    for sample in (0, 1):
        _, memory = LAW.step(dextar, instant_at(dextar, plan, crossing_sample(plan) + sample, 1e-3), memory, settings)
    problem = solved[-1]
    solution = solve(problem, None, 1.0)
    assert solution.torques is not None
    assert solution.duals is not None
    rows = np.vstack((np.eye(len(solution.torques)), problem.rows))
    values = rows @ solution.torques
    slack = np.minimum(values - problem.low, problem.high - values)
    assert np.sum(slack < 1e-9) >= 5, "the limits have to be felt"
    assert np.min(slack) > -1e-9
    pull = problem.quadratic @ solution.torques + problem.gradient + rows.T @ solution.duals
    assert np.max(np.abs(pull)) < 1e-6 * np.max(np.abs(problem.gradient))
    assert np.max(np.abs(solution.duals * slack)) < 1e-6 * np.max(np.abs(solution.duals))
    # a start from there changes nothing
    again = solve(problem, solution.duals, 1.0)
    assert again.torques is not None
    np.testing.assert_allclose(again.torques, solution.torques, rtol=0.0, atol=1e-8)


@pytest.mark.parametrize("why", ["not finished", "too little ahead", "out of reach"])
def test_unified_answers_where_there_is_no_solution(dextar: FiveBar, monkeypatch: pytest.MonkeyPatch, why: str) -> None:
    plan = middle(dextar, 0.5)
    instant = instant_at(dextar, plan, 40, 1e-3)
    settings = as_numbers(MpcSettings(torque_limit=0.3))
    assert instant.ahead is not None
    if why == "not finished":
        monkeypatch.setattr(mpc_problem, "MOST_ITERATIONS", 1)
    elif why == "too little ahead":
        instant = instant._replace(ahead=instant.ahead[:-1])
    else:
        instant = instant._replace(ahead=(instant.ahead[0]._replace(y=1.0), *instant.ahead[1:]))
    torque, memory = LAW.step(dextar, instant, LAW.memory, settings)
    standing_in = unified_settings(settings, settings.observer_rate)
    wanted, kept = unified_step(
        dextar, instant.state, instant.reference, LAW.memory.unified, standing_in, instant.period
    )
    assert torque == wanted
    assert (memory.unified, memory.unfinished) == (kept, 1)


def test_after_a_gap_only_the_disturbance_is_kept(dextar: FiveBar) -> None:
    plan = middle(dextar, 0.5)
    settings = as_numbers(MpcSettings())
    memory = LAW.memory
    for sample in range(3):
        _, memory = LAW.step(dextar, instant_at(dextar, plan, sample, 1e-3), memory, settings)
    assert memory.unified.d1 != 0.0
    after = LAW.after_gap(memory)
    assert (after.unified.d1, after.unified.d2) == (memory.unified.d1, memory.unified.d2)
    assert after.unified.unset
    assert (after.torque, after.duals) == (None, None)


def test_an_estimated_disturbance_takes_the_place_of_the_observer(dextar: FiveBar) -> None:
    """It comes with the reference's friction, and holds over the whole horizon."""
    plan, settings = middle(dextar, 0.5), as_numbers(MpcSettings())
    torques = []
    for disturbance in (0.0, 0.1):
        memory = LAW.memory
        for sample in range(3):
            instant = instant_at(dextar, plan, sample, 1e-4)
            reference = against_disturbance(instant.reference, disturbance, -disturbance)
            torque, memory = LAW.step(dextar, instant._replace(reference=reference), memory, settings)
            torques.append(torque)
        assert (memory.unified.d1 == 0.0) == (disturbance != 0.0)
    # without an error of the model, and before the observer has learnt from the offset, only the disturbance differs
    assert torques[3].tau1 == pytest.approx(torques[0].tau1 - 0.1, abs=1e-9)
    assert torques[3].tau2 == pytest.approx(torques[0].tau2 + 0.1, abs=1e-9)
