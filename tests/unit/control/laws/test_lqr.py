"""The linear-quadratic regulator along a plan: its gains, and crossings that meet the criterion or do not."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.linalg import solve_discrete_are

from fivebar_control.laws.law import Instant
from fivebar_control.laws.lqr import LAW, LqrSettings, linearised, lqr_gains
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.loop.plan_sample import planned_references
from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform
from fivebar_control.planning.predicted_run import PredictedRun, predict_run
from fivebar_control.trajectory.planner import ZoneRule, plan_motion
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import as_numbers

RATE_HZ = 500


def test_the_gain_at_rest_solves_the_algebraic_riccati_equation(dextar: FiveBar) -> None:
    rest, settings = Platform(0.0, 0.15, 0.0, 0.0, 0.0, 0.0), as_numbers(LqrSettings())
    gain = lqr_gains(dextar, 1, -1, [rest], 1.0 / RATE_HZ, settings)[rest]
    linear = linearised(dextar, 1, -1, rest, 1.0 / RATE_HZ)
    assert linear is not None
    weights = np.diag([1.0, 1.0, settings.speed_time**2, settings.speed_time**2])
    f, h = linear.transition, linear.inputs
    value = solve_discrete_are(f, h, weights, settings.weight * np.eye(2))
    wanted = np.linalg.solve(h.T @ value @ h + settings.weight * np.eye(2), h.T @ value @ f)
    np.testing.assert_allclose([gain.row1, gain.row2], wanted, rtol=1e-6)
    assert (gain.u1, gain.u2) == (0.0, 0.0)


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
    gains = LAW.prepare(dextar, 1, -1, planned_references(plan, RATE_HZ), 1.0 / RATE_HZ, settings)
    assert len(gains) == 26
    held = reference_from_platform(dextar, 1, -1, Platform(0.0, 0.14, 0.0, 0.0, 0.0, 0.0))
    moved = reference_from_platform(dextar, 1, -1, Platform(0.0, 0.139, 0.0, 0.0, 0.0, 0.0)).state
    instant = Instant(moved, held, Line(0.0, 0.14, 0.0, -1.0), 1, -1, 0.0, 1.0 / RATE_HZ, None)
    torque, memory = LAW.step(dextar, instant, gains, settings)
    assert memory is gains
    assert max(abs(torque.tau1), abs(torque.tau2)) == pytest.approx(0.2)
