"""The limits of a scenario's motions: one place for goals, programs, scenarios and all studies."""

from __future__ import annotations

import math

from fivebar_control.laws.registry import TunedController
from fivebar_control.planning.feasibility import is_predictable
from fivebar_control.planning.limits import (
    MotionLimits,
    limits_of_given,
    motion_limits_of,
    reach_within,
    speed_step_of,
)
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_control.trajectory.planner import Plan

ZONE_PASSAGES = 3.0
"""Longest stay of a blended controller in a zone, as a multiple of the planned time at sigma = 1. A passage at constant
speed takes twice that time. At low rates, where a zone spans a number of samples, this exceeds the limit in s."""


def chosen_limits(
    scenario: ControlScenario,
    follower: TunedController | None = None,
    torque: float | None = None,
    motor_speed: float | None = None,
) -> MotionLimits:
    """Return the limits of a motion that a planner chooses for a scenario's robot.

    Args:
        scenario: of which the motion itself does not count.
        follower: the controller, by default the scenario's.
        torque: what each motor can give (Nm), by default the scenario's limit.
        motor_speed: of either motor (rad/s), by default the scenario's limit.
    """
    controller = scenario.tuned() if follower is None else follower
    return _within(scenario, motion_limits_of(controller, *_drives(scenario, torque, motor_speed)))


def given_limits(scenario: ControlScenario, plan: Plan, torque: float | None = None) -> MotionLimits:
    """Return the limits of the motion that a scenario gives, with its plan; `torque` (Nm) as for `chosen_limits`."""
    limits = limits_of_given(
        scenario.tuned(),
        *_drives(scenario, torque),
        predictable=is_predictable(plan),
        within_reach=reach_within(scenario.five_bar(), scenario.known_within()),
    )
    if scenario.sees and scenario.ekf.camera:
        # the estimator does not give up near the locus, since it sees on which side the platform is
        limits = limits._replace(dwell=math.inf, rest=0.0)
    return _within(scenario, limits._replace(zone_stay=max(limits.zone_stay, ZONE_PASSAGES * plan.zone_time)))


def _within(scenario: ControlScenario, limits: MotionLimits) -> MotionLimits:
    return limits.within(
        scenario.judge,
        scenario.error_tolerance,
        scenario.tracking_error_limit,
        scenario.risk,
        scenario.to_bear(),
        scenario.kept_clear_of(),
        scenario.safety.area,
        scenario.elbows_pass(),
    )


def _drives(scenario: ControlScenario, torque: float | None, speed: float | None = None) -> tuple[float, float, float]:
    """Return what each motor can give (Nm, rad/s), by default by the scenario, and the step of its speed (rad/s)."""
    limit = scenario.torque_limit if torque is None else torque
    return (
        math.inf if limit is None else limit,
        scenario.safety.joint_speed_limit if speed is None else speed,
        speed_step_of(scenario.rate_hz, scenario.plant.encoder_counts),
    )
