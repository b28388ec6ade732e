# SPDX-License-Identifier: Apache-2.0
"""The conditions by which requests for a motion are judged in a run: the limits, sensors and loads of its scenario."""

from __future__ import annotations

from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.orders import Conditions
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_control.scenario.sensors import sensing_if_estimated
from fivebar_control.scenario.stopping import stop_cycles


def conditions_of(scenario: ControlScenario, by_the_clock: bool = False) -> Conditions:
    """Return the conditions that judge requests; by the clock, a motion has to bear that the last torque is held.

    Raises:
        InputError: the robot's file cannot be read, or the motion is refused, which decides how long that is.
    """
    limit = motor_torque_limit(scenario)
    return Conditions(
        scenario.robot,
        scenario.rate_hz,
        MotionLimits().torque if limit is None else limit,
        scenario.safety.joint_speed_limit,
        scenario.judge,
        scenario.error_tolerance,
        scenario.risk,
        sensing_if_estimated(scenario),
        scenario.to_bear(),
        stop_cycles(scenario) / scenario.rate_hz if by_the_clock else 0.0,
        scenario.tracking_error_limit,
        scenario.safety.area,
        scenario.safety.forbidden,
        scenario.controller,
        tuned_controller(scenario).nominal.settings,
    )
