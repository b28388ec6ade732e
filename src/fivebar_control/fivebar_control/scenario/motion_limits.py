# SPDX-License-Identifier: Apache-2.0
"""The limits of a scenario's motions: one place for goals, programs, scenarios and all studies."""

from __future__ import annotations

import math

from fivebar_control.laws.registry import TunedController
from fivebar_control.planning.limits import MotionLimits, motion_limits_of, reach_within, speed_step_of
from fivebar_control.scenario.guard_settings import forbidden_postures, guard_settings
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_control.trajectory.planner import Plan
from fivebar_description.robot_file import read_robot

ZONE_PASSAGES = 3.0
"""Longest stay of a blended controller in a zone, as a multiple of the planned time at sigma = 1. A passage at constant
speed takes twice that time. At low rates, where a zone spans a number of samples, this exceeds the limit in s."""


def scenario_limits(
    scenario: ControlScenario,
    plan: Plan | None = None,
    follower: TunedController | None = None,
    torque: float | None = None,
    motor_speed: float | None = None,
) -> MotionLimits:
    """Return the limits of the motion that a scenario gives, or without a plan of one that a planner chooses.

    Args:
        scenario: of which the motion itself does not count where it is chosen.
        plan: the motion that the scenario gives.
        follower: the controller, by default the scenario's.
        torque: what each motor can give (Nm), by default the scenario's limit.
        motor_speed: of either motor (rad/s), by default the scenario's limit.
    """
    limits = motion_limits_of(
        tuned_controller(scenario) if follower is None else follower,
        guard_settings(scenario).torque_limit if torque is None else torque,
        scenario.safety.joint_speed_limit if motor_speed is None else motor_speed,
        speed_step_of(scenario.rate_hz, scenario.plant.encoder_counts),
        # the run of a motion through Type 1 is not predicted
        None if plan is None or plan.modes else reach_within(scenario.five_bar(), scenario.known_within()),
        MotionLimits(
            judge=scenario.judge,
            tracking_error=scenario.tracking_error_limit,
            error_tolerance=scenario.error_tolerance,
            risk=scenario.risk,
            loads=scenario.to_bear(),
            forbidden=forbidden_postures(scenario),
            workspace=scenario.safety.area,
            elbows_pass=read_robot(scenario.robot).elbows_pass,
        ),
    )
    if plan is None:
        return limits
    if scenario.sees and scenario.ekf.camera:
        # the estimator does not give up near the locus, since it sees on which side the platform is
        limits = limits._replace(dwell=math.inf, rest=0.0)
    return limits._replace(zone_stay=max(limits.zone_stay, ZONE_PASSAGES * plan.zone_time))
