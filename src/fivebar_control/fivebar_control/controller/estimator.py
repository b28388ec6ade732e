# SPDX-License-Identifier: Apache-2.0
"""The state estimator of a scenario."""

from __future__ import annotations

from fivebar_control.estimation.constants import EstimatorModel, Instrumentation, estimator_model
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_control.scenario.sensors import homing_of
from fivebar_description.parameters import FiveBar


def estimator_of(scenario: ControlScenario, kind: type[StateEstimator] = StateEstimator) -> StateEstimator:
    """Return a new estimator for a run of a scenario.

    Raises:
        HomingContradicted: the declared posture contradicts itself.
    """
    return kind(scenario.five_bar(), homing_of(scenario), instruments_of(scenario))


def estimator_model_of(scenario: ControlScenario, robot: FiveBar) -> EstimatorModel:
    """Return the constants of that estimator, for a robot that is the scenario's, maybe with other types of number."""
    return estimator_model(robot, scenario.working_mode, instruments_of(scenario))


def instruments_of(scenario: ControlScenario) -> Instrumentation:
    """Return what is declared for the estimator of a scenario."""
    return Instrumentation(
        scenario.rate_hz,
        scenario.drives(),
        scenario.ekf,
        scenario.known_within(),
        scenario.passive,
        scenario.known_sensors(),
        scenario.extra(),
    )
