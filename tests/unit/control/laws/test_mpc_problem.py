# SPDX-License-Identifier: Apache-2.0
"""The quadratic program of the predictive law against its cost, summed up over a simulated horizon, and its limits."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.laws.law import Instant
from fivebar_control.laws.mpc import (
    MpcSettings,
    changed_by_at_most,
    observed_from,
    row_of,
    unified_settings,
    window_of,
)
from fivebar_control.laws.mpc_problem import (
    LEAST_WEIGHT,
    NO_PLAN,
    SCALE,
    QuadraticProgram,
    TorqueBounds,
    problem_of,
    solve,
    weights_of,
)
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.laws.torque import Torque
from fivebar_control.laws.unified import INITIAL_MEMORY, input_map, observed_disturbance, unified_step
from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform
from fivebar_description.parameters import FiveBar, friction_torque
from fivebar_description.settings import as_numbers

Vector = NDArray[np.float64]

HORIZON, PERIOD = 4, 0.01
SPEED_TIME, END_WEIGHT, STEP_WEIGHT, WEIGHT = 0.03, 7.0, 2e-3, 5e-3
DISTURBANCE = (0.04, -0.07)


class Case(NamedTuple):
    """A window, the present sample and a plan, all drawn at random."""

    rows: Vector
    here: Vector
    plan: Vector


@pytest.fixture(scope="module")
def case() -> Case:
    random = np.random.default_rng(8)
    return Case(random.normal(size=(HORIZON, 14)), random.normal(size=12), random.normal(size=2 * HORIZON))


def problem(
    case: Case,
    plan: Vector = NO_PLAN,
    last: tuple[float, float] = (math.nan, math.nan),
    limit: float = math.inf,
    step: float = math.inf,
) -> QuadraticProgram:
    weights = weights_of(HORIZON, PERIOD, SPEED_TIME, END_WEIGHT, STEP_WEIGHT, WEIGHT)
    return problem_of(weights, case.rows, case.here, DISTURBANCE, plan, TorqueBounds(last, limit, step))


def cost(case: Case, plan: Vector, torques: Vector) -> float:
    """Half of the cost of torques beyond friction, over a platform that is moved from sample to sample."""
    place, speed, total = case.here[0:2], case.here[2:4], 0.0
    maps = np.vstack((case.here[None, 4:10], case.rows[:, 6:12]))
    departs_before = np.zeros(2)
    for sample in range(HORIZON):
        u = torques[2 * sample : 2 * sample + 2]
        mean = 0.5 * (maps[sample] + maps[sample + 1])
        acceleration = mean[:4].reshape(2, 2) @ u + mean[4:]
        place, speed = place + PERIOD * speed + 0.5 * PERIOD**2 * acceleration, speed + PERIOD * acceleration
        off, speed_off = case.rows[sample, 0:2] - place, case.rows[sample, 2:4] - speed
        end = END_WEIGHT if sample == HORIZON - 1 else 1.0
        total += end * float(off @ off + SPEED_TIME**2 * speed_off @ speed_off)
        departs = u - (plan[2 * sample : 2 * sample + 2] if len(plan) else 0.0)
        change = departs - departs_before
        total += float(STEP_WEIGHT * change @ change + WEIGHT * departs @ departs + LEAST_WEIGHT * STEP_WEIGHT * u @ u)
        departs_before = departs
    return 0.5 * SCALE * total


@pytest.mark.parametrize("planned", [True, False])
def test_the_program_is_the_cost_of_the_predicted_motion(case: Case, planned: bool) -> None:
    plan = case.plan if planned else NO_PLAN
    found, none = problem(case, plan), np.zeros(2 * HORIZON)
    for torques in np.random.default_rng(9).normal(size=(30, 2 * HORIZON)):
        expected = cost(case, plan, torques) - cost(case, plan, none)
        value = 0.5 * torques @ found.quadratic @ torques + found.gradient @ torques
        assert value == pytest.approx(expected, rel=1e-9, abs=1e-9 * SCALE)
    np.testing.assert_allclose(found.quadratic, found.quadratic.T, rtol=1e-12)


def offsets(case: Case) -> Vector:
    """What a torque has besides u in each sample: friction, which is that of its beginning, less the disturbance."""
    friction = np.vstack((case.here[None, 10:12], case.rows[:-1, 12:14]))
    return np.asarray((friction - np.array(DISTURBANCE)).reshape(-1))


@pytest.mark.parametrize("last", [(math.nan, math.nan), (0.3, -0.2), (3.4, -3.4)])
def test_limits_are_those_of_the_torques_and_of_their_changes(case: Case, last: tuple[float, float]) -> None:
    limit, step = 3.5, 0.25
    found, off = problem(case, case.plan, last, limit, step), offsets(case)
    low, high = np.full(2 * HORIZON, -limit), np.full(2 * HORIZON, limit)
    for motor in range(2):
        if not math.isnan(last[motor]):
            low[motor], high[motor] = max(-limit, last[motor] - step), min(limit, last[motor] + step)
    np.testing.assert_allclose(found.low[: 2 * HORIZON], low - off, atol=1e-12)
    np.testing.assert_allclose(found.high[: 2 * HORIZON], high - off, atol=1e-12)
    changes = off[2:] - off[:-2]
    np.testing.assert_allclose(found.low[2 * HORIZON :], -step - changes, atol=1e-12)
    np.testing.assert_allclose(found.high[2 * HORIZON :], step - changes, atol=1e-12)
    torques = np.arange(2.0 * HORIZON) ** 2
    np.testing.assert_array_equal(found.rows @ torques, torques[2:] - torques[:-2])


def test_without_a_limit_of_changes_there_are_no_rows(case: Case) -> None:
    found = problem(case, last=(0.3, -0.2), limit=2.0)
    assert (len(found.rows), len(found.low), len(found.high)) == (0, 2 * HORIZON, 2 * HORIZON)
    np.testing.assert_allclose(found.low, -2.0 - offsets(case), atol=1e-12)


def moving(sample: int) -> Platform:
    """A motion that the robot can follow."""
    t = PERIOD * sample
    return Platform(0.01 + 0.1 * t, 0.13 - 0.2 * t, 0.1, -0.2, 0.3, -0.4)


def instant_at(robot: FiveBar, sample: int) -> Instant:
    ahead = tuple(moving(sample + 1 + number) for number in range(HORIZON + 1))
    reference = reference_from_platform(robot, (1, -1), moving(sample))
    state = reference_from_platform(robot, (1, -1), moving(sample)._replace(x=0.0102, vx=0.15)).state
    return Instant(state, reference, Line(0.0, 0.0, 0.0, -1.0), (1, -1), 0.0, PERIOD, ahead)


def test_a_row_has_a_reference_its_input_map_and_its_friction(dextar: FiveBar) -> None:
    reference = reference_from_platform(dextar, (1, -1), moving(3))
    friction = [
        friction_torque(dextar.leg1, reference.state.leg1.dq1),
        friction_torque(dextar.leg2, reference.state.leg2.dq1),
    ]
    mapped = input_map(dextar, reference.state)
    assert mapped is not None
    assert row_of(dextar, (1, -1), moving(3)) == (*moving(3), *mapped, *friction)
    away = row_of(dextar, (1, -1), moving(3)._replace(y=1.0))
    assert len(away) == 14
    assert any(map(math.isnan, away))


def test_a_window_that_follows_another_has_one_new_row(dextar: FiveBar) -> None:
    first, second = (instant_at(dextar, sample) for sample in (0, 1))
    window = window_of(dextar, first, HORIZON, None)
    assert window is not None
    assert second.ahead is not None
    fresh = window_of(dextar, second, HORIZON, None)
    assert fresh is not None
    assert window.ahead == (first.ahead or ())[:HORIZON]
    np.testing.assert_array_equal(fresh.rows, [row_of(dextar, (1, -1), one) for one in second.ahead[:HORIZON]])
    marked = window._replace(rows=np.arange(14.0 * HORIZON).reshape(HORIZON, 14))
    for other, rows in ((second, marked.rows[1:]), (first, window.rows[:-1])):
        followed = window_of(dextar, other, HORIZON, marked)
        assert followed is not None
        np.testing.assert_array_equal(followed.rows[:-1], rows)
        np.testing.assert_array_equal(followed.rows[-1], (fresh if other is second else window).rows[-1])
    assert window_of(dextar, first._replace(ahead=second.ahead[: HORIZON - 1]), HORIZON, None) is None


def test_the_observer_keeps_of_a_sample_what_that_of_the_law_that_stands_in_keeps(dextar: FiveBar) -> None:
    settings = unified_settings(as_numbers(MpcSettings()), 40.0)
    memory = INITIAL_MEMORY
    for sample in range(3):
        instant = instant_at(dextar, sample)
        mapped = input_map(dextar, instant.state)
        assert mapped is not None
        d1, d2 = observed_disturbance(mapped, instant.state, memory, settings, PERIOD)
        torque, memory = unified_step(dextar, instant.state, instant.reference, memory, settings, PERIOD)
        found = observed_from(mapped, instant.state, instant.reference, torque, d1, d2)
        assert found == pytest.approx(memory, rel=1e-12)
    assert memory.d1 != 0.0


def test_a_torque_changes_by_a_step_at_most() -> None:
    assert changed_by_at_most(Torque(1.0, -1.0), Torque(0.5, 0.5), 0.25) == (0.75, 0.25)
    assert changed_by_at_most(Torque(-1.0, 1.0), Torque(0.5, 0.5), 0.25) == (0.25, 0.75)
    assert changed_by_at_most(Torque(0.6, 0.4), Torque(0.5, 0.5), 0.25) == (0.6, 0.4)
    assert changed_by_at_most(Torque(9.0, -9.0), Torque(0.5, 0.5), math.inf) == (9.0, -9.0)
    assert changed_by_at_most(Torque(9.0, -9.0), None, 0.25) == (9.0, -9.0)


@pytest.mark.parametrize("unit", [0.25, 1.0, 8.0])
def test_the_solution_does_not_depend_on_the_unit_of_the_torques(unit: float) -> None:
    """One torque is at its upper bound, one at its lower bound; of the third and the fourth, the change is bounded."""
    quadratic, gradient = np.diag([1.0, 2.0, 1.0, 1.0]), np.array([-2.0, 4.0, -0.6, -0.1])
    low, high = np.array([-0.5, -0.5, -0.5, -0.5, -0.3]), np.array([0.4, 0.4, 0.7, 0.7, 0.3])
    problem = QuadraticProgram(quadratic, gradient, np.array([[0.0, 0.0, 1.0, -1.0]]), low, high)
    torques = solve(problem, None, unit).torques
    # without the bound on the change the last two were 0.6 and 0.1
    assert torques == pytest.approx([0.4, -0.5, 0.5, 0.2], abs=1e-8)
