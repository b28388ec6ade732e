# SPDX-License-Identifier: Apache-2.0
"""The linear-quadratic regulator along a plan: its gains, and crossings that meet the criterion or do not."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import solve_discrete_are

from fivebar_control import compiling
from fivebar_control.laws.law import Instant
from fivebar_control.laws.lqr import LAW, Gain, LqrSettings, linearised, lqr_gains, riccati_step
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.loop.plan_sample import planned_references
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform
from fivebar_control.planning.predicted_run import PredictedRun, predict_run
from fivebar_control.trajectory.planner import plan_motion
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import as_numbers

Vector = NDArray[np.float64]

RATE_HZ = 500


def test_the_gain_at_rest_solves_the_algebraic_riccati_equation(dextar: FiveBar) -> None:
    rest, settings = Platform(0.0, 0.15, 0.0, 0.0, 0.0, 0.0), as_numbers(LqrSettings())
    gain = lqr_gains(dextar, (1, -1), [rest], 1.0 / RATE_HZ, settings)[rest]
    linear = linearised(dextar, (1, -1), rest, 1.0 / RATE_HZ)
    assert linear is not None
    weights = np.diag([1.0, 1.0, settings.speed_time**2, settings.speed_time**2])
    f, h = linear.transition, linear.inputs
    value = solve_discrete_are(f, h, weights, settings.weight * np.eye(2))
    wanted = np.linalg.solve(h.T @ value @ h + settings.weight * np.eye(2), h.T @ value @ f)
    np.testing.assert_allclose([gain.row1, gain.row2], wanted, rtol=1e-6)
    assert (gain.u1, gain.u2) == (0.0, 0.0)


def test_the_planned_torques_are_those_for_both_accelerations(dextar: FiveBar) -> None:
    settings = as_numbers(LqrSettings())
    gain = lqr_gains(dextar, (1, -1), [MOVING], 1.0 / RATE_HZ, settings)[MOVING]
    response = direct_dynamics(dextar, state_from_platform(dextar, (1, -1), *MOVING[:4]), gain.u1, gain.u2, 0.0, 0.0)
    assert (response.ax, response.ay) == pytest.approx((MOVING.ax, MOVING.ay), rel=1e-6)


MOVING = Platform(0.01, 0.13, 0.2, -0.3, 1.0, -2.0)
"""An instant away from the locus."""


def after(robot: FiveBar, start: Vector, torques: tuple[float, float], period: float, steps: int = 50) -> Vector:
    """Return position and velocity after a period without friction, in many small steps of the midpoint rule."""
    h = period / steps

    def rate(moving: Vector) -> Vector:
        response = direct_dynamics(robot, state_from_platform(robot, (1, -1), *moving.tolist()), *torques, 0.0, 0.0)
        return np.array([moving[2], moving[3], response.ax, response.ay])

    for _ in range(steps):
        start = start + h * rate(start + 0.5 * h * rate(start))
    return start


def test_the_linearisation_is_the_derivative_of_a_sample(dextar: FiveBar) -> None:
    linear = linearised(dextar, (1, -1), MOVING, 1.0 / RATE_HZ)
    assert linear is not None
    place, torques = np.array(MOVING[:4]), linear.torques
    response = direct_dynamics(dextar, state_from_platform(dextar, (1, -1), *MOVING[:4]), *torques, 0.0, 0.0)
    assert (response.ax, response.ay) == pytest.approx((MOVING.ax, MOVING.ay), rel=1e-6)

    def moved(shift: Vector, more: Vector) -> Vector:
        return after(dextar, place + shift, (torques[0] + more[0], torques[1] + more[1]), 1.0 / RATE_HZ)

    for column, step in enumerate(1e-5 * np.eye(4)):
        expected = (moved(step, np.zeros(2)) - moved(-step, np.zeros(2))) / 2e-5
        np.testing.assert_allclose(linear.transition[:, column], expected, rtol=2e-2, atol=2e-4)
    for column, step in enumerate(1e-4 * np.eye(2)):
        expected = (moved(np.zeros(4), step) - moved(np.zeros(4), -step)) / 2e-4
        np.testing.assert_allclose(linear.inputs[:, column], expected, rtol=1e-2, atol=1e-7)


def test_out_of_reach_there_is_no_linearisation_and_what_comes_before_has_no_gain(dextar: FiveBar) -> None:
    rest = Platform(0.0, 0.15, 0.0, 0.0, 0.0, 0.0)
    assert linearised(dextar, (1, -1), rest._replace(y=0.5), 1.0 / RATE_HZ) is None
    references = [rest._replace(y=0.14), rest._replace(y=0.5), rest._replace(y=0.149), rest]
    settings = as_numbers(LqrSettings())
    assert set(lqr_gains(dextar, (1, -1), references, 1.0 / RATE_HZ, settings)) == set(references[2:])


@pytest.mark.extra
def test_as_machine_code_the_gains_are_the_same(dextar: FiveBar, monkeypatch: pytest.MonkeyPatch) -> None:
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.14), (0.0, 0.04)), [0.2], RATE_HZ, ZoneRule())
    references, settings = planned_references(plan, RATE_HZ), as_numbers(LqrSettings())
    plain = lqr_gains(dextar, (1, -1), references, 1.0 / RATE_HZ, settings)
    monkeypatch.setattr(compiling, "_many_motions", True)
    compiled = lqr_gains(dextar, (1, -1), references, 1.0 / RATE_HZ, settings)
    assert list(compiled) == list(plain)
    for reference, gain in plain.items():
        for found, wanted in zip(compiled[reference][2:], gain[2:], strict=True):
            assert found == pytest.approx(wanted, rel=1e-9)
        assert compiled[reference][:2] == pytest.approx(gain[:2], rel=1e-9)


def test_a_step_backwards_is_the_least_cost_of_a_sample(dextar: FiveBar) -> None:
    """Of the error now, the torque, and the cost that the error after the sample will have."""
    random = np.random.default_rng(6)
    linear = linearised(dextar, (1, -1), MOVING, 1.0 / RATE_HZ)
    assert linear is not None
    root = random.normal(size=(4, 4))
    value, weights, weight = root @ root.T, np.diag([1.0, 1.0, 0.1, 0.1]), 1e-4

    def cost(error: Vector, torque: Vector) -> float:
        later = linear.transition @ error + linear.inputs @ torque
        return float(error @ weights @ error + weight * torque @ torque + later @ value @ later)

    before, feedback = riccati_step(linear, value, weights, weight)
    np.testing.assert_array_equal(before, before.T)
    for error in random.normal(size=(5, 4)):
        best = -feedback @ error
        assert float(error @ before @ error) == pytest.approx(cost(error, best), rel=1e-9)
        for off in 0.1 * random.normal(size=(5, 2)):
            assert cost(error, best + off) > cost(error, best)


@pytest.mark.parametrize("limit", [None, 0.5])
def test_the_torque_is_the_planned_one_less_the_gains_times_the_error(dextar: FiveBar, limit: float | None) -> None:
    reference = reference_from_platform(dextar, (1, -1), MOVING)
    gain = Gain(0.3, -0.4, (1.0, 2.0, 3.0, 4.0), (-5.0, 6.0, -7.0, 8.0))
    for size in (0.01, -0.3):
        error = size * np.array([1.0, -0.5, 2.0, 0.25])
        off = MOVING._replace(**dict(zip(("x", "y", "vx", "vy"), (np.array(MOVING[:4]) + error).tolist(), strict=True)))
        state = reference_from_platform(dextar, (1, -1), off).state
        instant = Instant(state, reference, Line(0.0, 0.14, 0.0, -1.0), (1, -1), 0.0, 1.0 / RATE_HZ, None)
        torque, _ = LAW.step(dextar, instant, {MOVING: gain}, as_numbers(LqrSettings(torque_limit=limit)))
        most = np.inf if limit is None else limit
        wanted = np.array([gain.u1 + reference.f1, gain.u2 + reference.f2]) - np.array([gain.row1, gain.row2]) @ error
        assert torque == pytest.approx(np.clip(wanted, -most, most).tolist(), rel=1e-9)


def crossed(robot: FiveBar, time_law: str) -> PredictedRun:
    """Return the run from one assembly mode to the other, across the locus well before half of the way."""
    plan = plan_motion(robot, (1, -1), ((0.0, 0.14), (0.0, 0.04)), [0.5], RATE_HZ, ZoneRule(), time_law=time_law)
    return predict_run(robot, plan, RATE_HZ, default_tuning(CONTROLLERS["lqr"]), 10.0)


def test_a_motion_that_misses_the_criterion_costs_a_multiple_of_the_torque(dextar: FiveBar) -> None:
    met, missed = (crossed(dextar, time_law) for time_law in ("criterion", "quintic"))
    assert met.mode_changes.value == 1.0
    assert met.error.value < 5e-5
    assert met.torque.value < 1.0
    assert missed.torque.value > 3.0 * met.torque.value


def test_unified_answers_for_a_reference_that_is_not_of_the_plan(dextar: FiveBar) -> None:
    plan = plan_motion(dextar, (1, -1), ((0.0, 0.15), (0.0, 0.13)), [0.05], RATE_HZ, ZoneRule())
    assert LAW.prepare is not None
    settings = as_numbers(LqrSettings(torque_limit=0.2))
    gains = LAW.prepare(dextar, (1, -1), planned_references(plan, RATE_HZ), 1.0 / RATE_HZ, settings)
    assert len(gains) == 26
    held = reference_from_platform(dextar, (1, -1), Platform(0.0, 0.14, 0.0, 0.0, 0.0, 0.0))
    moved = reference_from_platform(dextar, (1, -1), Platform(0.0, 0.139, 0.0, 0.0, 0.0, 0.0)).state
    instant = Instant(moved, held, Line(0.0, 0.14, 0.0, -1.0), (1, -1), 0.0, 1.0 / RATE_HZ, None)
    torque, memory = LAW.step(dextar, instant, gains, settings)
    assert memory is gains
    assert max(abs(torque.tau1), abs(torque.tau2)) == pytest.approx(0.2)
