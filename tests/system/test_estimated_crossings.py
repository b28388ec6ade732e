# SPDX-License-Identifier: Apache-2.0
"""Crossings from the two motor encoders alone: how well the platform is known, and how well it keeps its track."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from engine_agreement import expect_completed, outcome_of
from estimate_replay import OFF_MODEL, encoder_scenario, summary_of

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import simulate
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.scenario_file import shipped_scenarios

pytestmark = pytest.mark.extra

NAMES, DURATIONS = ("middle", "multiple"), (0.5, 1.0, 2.0)
CROSSINGS = {"middle": 2, "multiple": 8}

ESTIMATE_LIMIT = 0.5e-3
TRACKING_LIMIT, OFF_MODEL_LIMIT = 2e-3, 4e-3

SOFT = (900.0, 60.0)
"""kp and kd of all laws."""


def expect_bounds(scenario: Scenario, name: str, tracking: float = math.inf) -> RunMetrics:
    """Run a scenario compiled; fail where it does not complete, or goes beyond the bounds."""
    outcome = outcome_of(scenario)
    expect_completed(outcome, scenario, CROSSINGS[name])
    assert 0.0 < outcome.estimate_error < ESTIMATE_LIMIT
    assert max(outcome.applied1, outcome.applied2) < 5.0
    assert 0.0 < outcome.error_peak < tracking
    return outcome


@pytest.mark.parametrize("duration", DURATIONS)
@pytest.mark.parametrize("name", NAMES)
def test_a_robot_as_believed(name: str, duration: float) -> None:
    expect_bounds(encoder_scenario(name, duration, SOFT), name, TRACKING_LIMIT)


@pytest.mark.parametrize("duration", DURATIONS)
@pytest.mark.parametrize("name", NAMES)
def test_a_robot_that_is_not_as_believed(name: str, duration: float) -> None:
    expect_bounds(encoder_scenario(name, duration, SOFT, OFF_MODEL), name, OFF_MODEL_LIMIT)


def test_the_report_judges_the_same() -> None:
    scenario = encoder_scenario("middle", 0.5, SOFT)
    (summary, series), outcome = summary_of(scenario), expect_bounds(scenario, "middle")
    assert summary.outcome == "succeeded", summary.not_completed_because
    assert summary.assembly_mode_changes == outcome.mode_changes
    assert summary.estimate_error_max_m == pytest.approx(outcome.estimate_error, rel=1e-3)
    assert summary.tracking_error_peak_m == pytest.approx(outcome.error_peak, rel=1e-3)
    assert summary.torque_peak_nm == pytest.approx((outcome.applied1, outcome.applied2), rel=1e-3)
    # the last sample's estimate is for a moment that the run does not have
    assert math.isnan(series.estimate_error[-1])
    assert not any(math.isnan(error) for error in series.estimate_error[:-1])


@pytest.mark.parametrize("name", NAMES)
def test_the_estimated_disturbance_takes_most_of_a_wrong_model(name: str) -> None:
    """Soft gains leave 4 mm and more of it at T = 1 s; with exact sensors and no delay they leave the same."""
    without, made_up = (
        expect_bounds(encoder_scenario(name, 1.0, SOFT, OFF_MODEL, ekf={"feed_forward": feed_forward}), name).error_peak
        for feed_forward in (False, True)
    )
    assert without > 3.5e-3
    assert made_up < 0.2 * without


def test_without_the_prediction_the_controllers_are_late() -> None:
    """What is published for a sample is the state in which its torque begins to act, not that of the measurement."""
    scenario = encoder_scenario("middle", 0.5)
    robot, samples = scenario.five_bar(), simulate(scenario).samples
    then, now = [], []
    for sample, later in pairwise(samples):
        told = state_from_joints(robot, *sample.measured.position, *sample.measured.velocity)
        for truth, errors in ((later.exact, then), (sample.exact, now)):
            exact = state_from_joints(robot, *truth.position, *truth.velocity)
            errors.append(math.hypot(told.x - exact.x, told.y - exact.y))
    assert max(then) < 0.2e-3
    # 0.49 m/s for 2 ms
    assert max(now) > 0.8e-3


@pytest.mark.parametrize("name", ["middle_encoders", "multiple_encoders"])
def test_shipped_scenarios_complete(name: str) -> None:
    assert name in shipped_scenarios()
    scenario = load_scenario(name)
    assert scenario.estimated
    assert scenario.lead_samples == scenario.plant.delay_samples == 1
    expect_bounds(scenario, name.removesuffix("_encoders"))


def test_an_ambiguous_estimate_ends_the_run_as_failed() -> None:
    scenario = encoder_scenario("middle", 0.5, ekf={"dwell_limit": 0.01})
    summary, _ = summary_of(scenario)
    assert summary.outcome in ("stopped", "off_reference")
    assert summary.faults[0] == "estimate_ambiguous"
