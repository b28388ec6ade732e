# SPDX-License-Identifier: Apache-2.0
"""The state estimator of a scenario, for every runner that is not its node."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.estimation.constants import EstimatorModel, estimator_model
from fivebar_control.estimation.estimator import StateEstimator
from fivebar_control.estimation.settings import Drives, EkfSettings
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_control.scenario.sensors import homing_of
from fivebar_description.extra_sensor import MountedSensor
from fivebar_description.parameters import FiveBar
from fivebar_description.sensors import KnownSensors, PassiveEncoder
from fivebar_description.tolerances import Tolerances


class _Declared(NamedTuple):
    """Declarations that an estimator has besides the robot, in the order of the arguments of `estimator_model`."""

    rate_hz: int
    drives: Drives
    settings: EkfSettings
    tolerances: Tolerances
    passive: PassiveEncoder
    known: KnownSensors
    extra: MountedSensor | None


def estimator_of(scenario: ControlScenario, kind: type[StateEstimator] = StateEstimator) -> StateEstimator:
    """Return a new estimator for a run of a scenario.

    Raises:
        HomingContradicted: the declared posture contradicts itself.
    """
    return kind(scenario.five_bar(), homing_of(scenario), *_declared(scenario))


def estimator_model_of(scenario: ControlScenario, robot: FiveBar) -> EstimatorModel:
    """Return the constants of that estimator, for a robot that is the scenario's, maybe with other types of number."""
    mode1, mode2 = scenario.working_mode
    return estimator_model(robot, mode1, mode2, *_declared(scenario))


def _declared(scenario: ControlScenario) -> _Declared:
    return _Declared(
        scenario.rate_hz,
        scenario.drives(),
        scenario.ekf,
        scenario.known_within(),
        scenario.passive,
        scenario.known_sensors(),
        scenario.extra(),
    )
