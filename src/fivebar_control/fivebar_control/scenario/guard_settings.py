# SPDX-License-Identifier: Apache-2.0
"""The limits of a scenario that the last node before the drives keeps."""

from __future__ import annotations

import math

from fivebar_control.safety.settings import SafetySettings
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.forbidden import NamedBounds, kept_clear_of, numbers_of
from fivebar_description.robot_file import read_robot


def guard_settings(scenario: ControlScenario) -> SafetySettings:
    """Return what the last node before the drives allows in a scenario's run."""
    drives = math.inf if scenario.plant.torque_limit is None else scenario.plant.torque_limit
    safety = scenario.safety
    return safety._replace(
        torque_limit=min(safety.torque_limit, drives),
        type1_margin=safety.type1_margin if scenario.working_modes is None else 0.0,
        tracking_error_limit=scenario.tracking_error_limit,
        forbidden=safety.forbidden or numbers_of(read_robot(scenario.robot).forbidden),
    )


def motor_torque_limit(scenario: ControlScenario) -> float | None:
    """Return the largest torque (Nm) that a motor can get: the lesser of the last node's limit and the drives'."""
    limit = guard_settings(scenario).torque_limit
    return limit if math.isfinite(limit) else None


def forbidden_postures(scenario: ControlScenario) -> tuple[NamedBounds, ...]:
    """Return the postures that the robot may not enter: by the section `safety`, by default as its file says."""
    return kept_clear_of(scenario.safety.forbidden, read_robot(scenario.robot).forbidden)
