"""Crossings from the two motor encoders alone: how well the platform is known, and how well it keeps its track."""

from __future__ import annotations

import math
from itertools import pairwise

import pytest
from estimate_replay import OFF_MODEL, encoder_scenario, summary_of

from fivebar_bringup.report.summary import Summary
from fivebar_bringup.scenario import load_scenario, shipped_scenarios
from fivebar_bringup.simulation.offline import simulate
from fivebar_control.model.kinematics import state_from_joints

NAMES, DURATIONS = ("middle", "multiple"), (0.5, 1.0, 2.0)
CROSSINGS = {"middle": 2, "multiple": 8}

ESTIMATE_LIMIT = 0.5e-3
TRACKING_LIMIT, OFF_MODEL_LIMIT = 2e-3, 4e-3

SOFT = (900.0, 60.0)
"""kp and kd of all laws."""


def expect_completed(summary: Summary, name: str) -> None:
    assert summary.completed, summary.not_completed_because
    assert summary.assembly_mode_changes == CROSSINGS[name]
    assert summary.estimate_error_max_m is not None
    assert summary.estimate_error_max_m < ESTIMATE_LIMIT
    assert max(peak for peak in summary.torque_peak_nm if peak is not None) < 5.0


@pytest.mark.parametrize("duration", DURATIONS)
@pytest.mark.parametrize("name", NAMES)
def test_a_robot_as_believed(name: str, duration: float) -> None:
    summary, series = summary_of(encoder_scenario(name, duration, SOFT))
    expect_completed(summary, name)
    assert summary.tracking_error_peak_m is not None
    assert summary.tracking_error_peak_m < TRACKING_LIMIT
    # the last sample's estimate is for a moment that the run does not have
    assert math.isnan(series.estimate_error[-1])
    assert not any(math.isnan(error) for error in series.estimate_error[:-1])


@pytest.mark.parametrize("duration", DURATIONS)
@pytest.mark.parametrize("name", NAMES)
def test_a_robot_that_is_not_as_believed(name: str, duration: float) -> None:
    summary, _ = summary_of(encoder_scenario(name, duration, SOFT, OFF_MODEL))
    expect_completed(summary, name)
    assert summary.tracking_error_peak_m is not None
    assert summary.tracking_error_peak_m < OFF_MODEL_LIMIT


@pytest.mark.parametrize("name", NAMES)
def test_the_estimated_disturbance_takes_most_of_a_wrong_model(name: str) -> None:
    """Soft gains leave 4 mm and more of it at T = 1 s; with exact sensors and no delay they leave the same."""
    errors = []
    for feed_forward in (False, True):
        scenario = encoder_scenario(name, 1.0, SOFT, OFF_MODEL, ekf={"feed_forward": feed_forward})
        summary, _ = summary_of(scenario)
        expect_completed(summary, name)
        assert summary.tracking_error_peak_m is not None
        errors.append(summary.tracking_error_peak_m)
    without, made_up = errors
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
    summary, _ = summary_of(scenario)
    expect_completed(summary, name.removesuffix("_encoders"))


def test_an_ambiguous_estimate_ends_the_run_as_failed() -> None:
    scenario = encoder_scenario("middle", 0.5, ekf={"dwell_limit": 0.01})
    summary, _ = summary_of(scenario)
    assert not summary.completed
    assert summary.faults[0] == "estimate_ambiguous"
