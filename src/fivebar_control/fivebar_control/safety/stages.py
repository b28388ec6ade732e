# SPDX-License-Identifier: Apache-2.0
"""The safety stages between requested torque and command, each a pure function.

The last node applies them in this order: finite, up to date (see `watchdog`), torque limit, torque rate limit, joint
speed, workspace, forbidden postures, Type 1 margin, tracking, torque request. The two limits saturate the torque; every
other stage detects a fault that stops the robot. `first_fault` returns it as a number, so that it can be compiled, and
`fault_of` describes it. An undefined value, NaN, passes none of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.fault import Fault
from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.model.geometry import workspace_margin
from fivebar_control.model.state import Leg, State, WorkingMode
from fivebar_control.safety.forbidden import (
    FORESEEN,
    NONE_FORBIDDEN,
    Forbidden,
    next_forbidden,
    time_to_forbidden,
    time_to_posture,
)
from fivebar_control.safety.settings import EVERYWHERE, Area, SafetySettings
from fivebar_description.forbidden import bounds_in
from fivebar_description.parameters import FiveBar
from fivebar_description.rounding import in_millimetres

REACH_TOLERANCE = 1e-3
"""Tolerance (m) of the reach of a leg: a platform farther outside means that the joint readings are inconsistent."""


NO_FAULT = 0
TORQUE_UNDEFINED, OVER_SPEED, OUT_OF_WORKSPACE, NEAR_TYPE_1, TRACKING_LOST = 1, 2, 3, 4, 5
TORQUE_EXCESSIVE, FORBIDDEN_POSTURE = 10, 11
"""Faults that the stages detect, as numbers, in the order of the stages."""

STAGE_NAMES = {
    TORQUE_UNDEFINED: "torque_undefined",
    OVER_SPEED: "over_speed",
    OUT_OF_WORKSPACE: "out_of_workspace",
    NEAR_TYPE_1: "near_type_1",
    TRACKING_LOST: "tracking_lost",
    TORQUE_EXCESSIVE: "torque_excessive",
    FORBIDDEN_POSTURE: "forbidden_posture",
}
"""Names of these faults."""


class Limits(NamedTuple):
    """Limits of the stages, as numbers; infinite for none.

    Attributes:
        torque_limit: largest commanded torque (Nm).
        torque_step: largest change of it from sample to sample (Nm).
        joint_speed: largest motor speed (rad/s).
        workspace: where the platform may be (m).
        type1_margin: least |sin q_i2|, 0 for no such limit.
        tracking_error: largest distance from the reference (m).
        torque_request: largest torque (Nm) that may be requested for a while.
        request_samples: number of samples in a row with a larger request that stop the robot.
        forbidden: postures that the robot may not enter.
    """

    torque_limit: float
    torque_step: float
    joint_speed: float
    workspace: Area
    type1_margin: float
    tracking_error: float
    torque_request: float
    request_samples: int
    forbidden: Forbidden = NONE_FORBIDDEN


def guard_limits_of(settings: SafetySettings, rate_hz: int) -> Limits:
    """Return the limits of the stages at a sampling rate (Hz)."""
    return Limits(
        torque_limit=float(settings.torque_limit),
        torque_step=float(settings.torque_rate_limit) / rate_hz,
        joint_speed=float(settings.joint_speed_limit),
        workspace=settings.area,
        type1_margin=float(settings.type1_margin),
        tracking_error=float(settings.tracking_error_limit),
        torque_request=float(settings.request_ratio) * float(settings.torque_limit),
        request_samples=int(settings.request_samples),
        forbidden=Forbidden(*bounds_in(settings.forbidden)),
    )


def first_fault(
    limits: Limits,
    robot: FiveBar,
    mode: WorkingMode,
    state: State,
    x: float,
    y: float,
    requested: Torque,
    excess: int = 0,
) -> int:
    """Return the number of the first fault that a sample shows, `NO_FAULT` for none.

    Args:
        limits: of the stages.
        robot: nominal robot of the controllers.
        mode: its working mode.
        state: measured or estimated state.
        x, y: where the platform should be (m).
        requested: the blended torque (Nm).
        excess: samples in a row, this one included, whose request was excessive (`excess_samples`).
    """
    if not is_finite(requested):
        return TORQUE_UNDEFINED
    if not is_slow(state, limits.joint_speed):
        return OVER_SPEED
    if not (is_inside(limits.workspace, state.x, state.y) and is_in_reach(robot, state)):
        return OUT_OF_WORKSPACE
    if time_to_forbidden(limits.forbidden, state) <= FORESEEN:
        return FORBIDDEN_POSTURE
    if not is_clear_of_type_1(state, mode, limits.type1_margin):
        return NEAR_TYPE_1
    if not distance_from(state, x, y) <= limits.tracking_error:
        return TRACKING_LOST
    if excess >= limits.request_samples:
        return TORQUE_EXCESSIVE
    return NO_FAULT


def excess_samples(limits: Limits, requested: Torque, before: int) -> int:
    """Return for how many samples in a row the request (Nm) has been excessive, `before` up to the last one."""
    most = limits.torque_request
    return before + 1 if abs(requested.tau1) > most or abs(requested.tau2) > most else 0


def limited_torque(limits: Limits, requested: Torque, before: Torque) -> Torque:
    """Return a torque (Nm) saturated by the torque limit and the rate limit, `before` being the last command."""
    return within(within(requested, ZERO, limits.torque_limit), before, limits.torque_step)


def is_finite(torque: Torque) -> bool:
    """Return whether both torques are finite numbers."""
    return math.isfinite(torque.tau1) and math.isfinite(torque.tau2)


def is_slow(state: State, limit: float) -> bool:
    """Return whether both motor joints turn at the limit (rad/s) at most."""
    return abs(state.leg1.dq1) <= limit and abs(state.leg2.dq1) <= limit


def is_inside(area: Area, x: float, y: float) -> bool:
    """Return whether a place (m) is in an area."""
    return area.x_min <= x <= area.x_max and area.y_min <= y <= area.y_max


def is_in_reach(robot: FiveBar, state: State) -> bool:
    """Return whether the platform is where both legs reach, but for `REACH_TOLERANCE`."""
    return workspace_margin(robot, state.x, state.y) >= -REACH_TOLERANCE


def type1_clearance(leg: Leg, mode: int) -> float:
    """Return sin q_i2 of a leg, positive on the side of its working mode: a mode of +1 has sin q_i2 < 0."""
    return -mode * leg.sin_q2


def is_clear_of_type_1(state: State, mode: WorkingMode, margin: float) -> bool:
    """Return whether both legs keep the margin on the side of the working mode; 0 is for motions through Type 1.

    The sign is tested because near Type 1 a leg moves fast: it may pass the boundary between two samples.
    """
    return margin <= 0.0 or (
        type1_clearance(state.leg1, mode[0]) >= margin and type1_clearance(state.leg2, mode[1]) >= margin
    )


def distance_from(state: State, x: float, y: float) -> float:
    """Return how far (m) the platform is from a place (m)."""
    return math.hypot(state.x - x, state.y - y)


def within(torque: Torque, middle: Torque, width: float) -> Torque:
    """Return the torque that is nearest to one (Nm) and at most a width (Nm) from another, motor by motor."""
    return Torque(
        max(middle.tau1 - width, min(middle.tau1 + width, torque.tau1)),
        max(middle.tau2 - width, min(middle.tau2 + width, torque.tau2)),
    )


def fault_of(
    number: int,
    limits: Limits,
    robot: FiveBar,
    mode: WorkingMode,
    state: State,
    x: float,
    y: float,
    requested: Torque,
    sigma: float,
) -> Fault:
    """Return the fault that :func:`first_fault` detected, in words; arguments as there, sigma the blending weight."""
    name = STAGE_NAMES[number]
    if number == TORQUE_UNDEFINED:
        detail = f"candidate torque ({requested.tau1}, {requested.tau2}) Nm, sigma = {sigma:.3f}"
        return Fault(name, detail)
    if number == OVER_SPEED:
        speed1, speed2 = state.leg1.dq1, state.leg2.dq1
        limit = limits.joint_speed
        return Fault(name, f"motors at {speed1:.2f} and {speed2:.2f} rad/s, limit {limit:g} rad/s")
    if number == OUT_OF_WORKSPACE:
        if limits.workspace != EVERYWHERE and not is_inside(limits.workspace, state.x, state.y):
            reason = f"workspace {list(limits.workspace)} m"
        else:
            beyond = -workspace_margin(robot, state.x, state.y)
            reason = f"{in_millimetres(beyond, 1)} out of reach: the joints contradict each other"
        return Fault(name, f"platform at ({state.x:.4f}, {state.y:.4f}) m, {reason}")
    if number == FORBIDDEN_POSTURE:
        which = next_forbidden(limits.forbidden, state)
        left = time_to_posture(limits.forbidden[which - 1], state)
        reached = f"is {left * 1e3:.0f} ms before" if left > 0.0 else "is in"
        return Fault(
            name,
            f"platform at ({state.x:.4f}, {state.y:.4f}) m, motors at {state.leg1.q1:.3f} and {state.leg2.q1:.3f} rad:"
            f" the robot {reached} forbidden posture {which}",
        )
    if number == NEAR_TYPE_1:
        clear1, clear2 = type1_clearance(state.leg1, mode[0]), type1_clearance(state.leg2, mode[1])
        margin = limits.type1_margin
        return Fault(name, f"sin q_i2 is {clear1:.4f} and {clear2:.4f} from Type 1, margin {margin:g}")
    if number == TORQUE_EXCESSIVE:
        limit = limits.torque_request
        detail = f"({requested.tau1:.4g}, {requested.tau2:.4g}) Nm requested, more than {limit:.4g} Nm for"
        return Fault(name, f"{detail} {limits.request_samples} samples")
    error, limit = distance_from(state, x, y), limits.tracking_error
    return Fault(name, f"{in_millimetres(error, 1)} from the reference, limit {limit * 1e3:g} mm")


def fastest_motor(state: State) -> float:
    """Return the speed (rad/s) of the faster motor joint; NaN where one is not known."""
    return max(abs(state.leg1.dq1), abs(state.leg2.dq1), key=lambda speed: math.inf if math.isnan(speed) else speed)
