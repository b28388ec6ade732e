# SPDX-License-Identifier: Apache-2.0
"""The state estimator of a scenario."""

from __future__ import annotations

from fivebar_control.estimation.constants import EstimatorModel, estimator_model
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_control.scenario.sensors import homing_of, sensing_of
from fivebar_description.parameters import FiveBar


def estimator_of(scenario: ControlScenario, kind: type[StateEstimator] = StateEstimator) -> StateEstimator:
    """Return a new estimator for a run of a scenario.

    Raises:
        HomingContradicted: the declared posture contradicts itself.
    """
    return kind(scenario.five_bar(), homing_of(scenario), sensing_of(scenario))


def estimator_model_of(scenario: ControlScenario, robot: FiveBar) -> EstimatorModel:
    """Return the constants of that estimator, for a robot that is the scenario's, maybe with other types of number."""
    return estimator_model(robot, scenario.working_mode, sensing_of(scenario))
