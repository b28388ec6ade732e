# SPDX-License-Identifier: Apache-2.0
"""The prediction on the compiled engine is the one that a screen makes without it."""

from __future__ import annotations

import math

import pytest

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.predicted import predict_on_engine
from fivebar_control.planning.predicted_run import PredictedRun, predict_run
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.trajectory.path_distance import PATH, TIMED
from fivebar_sim.effects.settings import PlantSettings


def both(scenario: Scenario, judge: str = TIMED) -> tuple[PredictedRun, PredictedRun]:
    robot, plan, rate_hz = scenario.five_bar(), scenario.plan(), scenario.rate_hz
    limit = math.inf if motor_torque_limit(scenario) is None else motor_torque_limit(scenario)
    asked = robot, plan, rate_hz, tuned_controller(scenario), limit
    return predict_run(*asked, judge), predict_on_engine(scenario, *asked, judge)


@pytest.mark.parametrize("controller", [pytest.param("multi_cartesian", marks=pytest.mark.extra), "unified"])
def test_both_predict_the_same(controller: str) -> None:
    """Whatever the plant and the sensors of the scenario are: predicted is the robot as modelled."""
    scenario = Scenario(
        name="predicted",
        controller=controller,
        waypoints=((0.0, 0.15), (0.01, 0.04)),
        segment_duration=0.6,
        estimator="ekf",
        plant=PlantSettings(mass_scale=1.2, encoder_counts=20_000, delay_samples=1, torque_limit=2.0),
    )
    interpreted, compiled = both(scenario)
    assert compiled.error == pytest.approx(interpreted.error, rel=1e-3, abs=1e-6)
    beside = [one.judged for one in both(scenario, PATH)]
    assert beside[0] != interpreted.error
    assert beside[1] == pytest.approx(beside[0], rel=1e-3, abs=1e-6)
    assert compiled.torque == pytest.approx(interpreted.torque, rel=1e-3, abs=1e-6)
    assert compiled.mode_changes == pytest.approx(interpreted.mode_changes, abs=1e-6)
    assert compiled.mode_changes.value == 1.0


def test_a_run_that_cannot_go_on_has_no_error_that_could_be_tolerated() -> None:
    """A torque limit that cannot follow: both end 50 mm from the reference."""
    scenario = Scenario(
        name="weak",
        controller="unified",
        waypoints=((0.0, 0.16), (0.0, 0.1)),
        segment_duration=0.2,
        plant=PlantSettings(torque_limit=0.05),
    )
    interpreted, compiled = both(scenario)
    assert interpreted.error.value == compiled.error.value == math.inf
    assert compiled.error.time == interpreted.error.time
