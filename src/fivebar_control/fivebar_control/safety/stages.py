"""The stages through which a torque goes before it becomes a command, each a pure function.

The last node goes through them in this order: finite, fresh (see `freshness`), torque limit, torque rate limit, joint
speed, workspace, Type 1 margin, tracking. The two limits cut the torque; every other stage returns the fault that stops
the robot, None where there is none.

What a stage asks is a scalar function of its own, without words, which the compiled engine asks too; an undefined
value, NaN, passes none of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.fault import Fault
from fivebar_control.laws.torque import Torque
from fivebar_control.model.singularity import type1_distance
from fivebar_control.model.state import Leg, State
from fivebar_description.parameters import FiveBar

REACH_TOLERANCE = 1e-3
"""How far (m) the platform may seem to be beyond a leg's reach: more cannot be, so the joints are misread."""


class Area(NamedTuple):
    """A rectangle in the plane (m)."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float


class SafetySettings(NamedTuple):
    """What the last node before the drives allows.

    Attributes:
        torque_limit: largest torque of either motor (Nm), inf for none.
        torque_rate_limit: fastest change of either torque (Nm/s), inf for none; a stop is not slowed by it.
        joint_speed_limit: largest speed of either motor joint (rad/s).
        workspace: where the platform may be; None for wherever both legs reach.
        type1_margin: least |sin q_i2|, on the side of the working mode; 0 for motions that pass through Type 1.
        tracking_error_limit: largest distance from the reference (m).
        rest_speed: speed of the motor joints (rad/s) below which the robot counts as at rest, for a reset.
    """

    torque_limit: float = math.inf
    torque_rate_limit: float = math.inf
    joint_speed_limit: float = 50.0
    workspace: Area | None = None
    type1_margin: float = 0.01
    tracking_error_limit: float = 0.05
    rest_speed: float = 0.1


def is_finite(torque: Torque) -> bool:
    """Return whether both torques are finite numbers."""
    return math.isfinite(torque.tau1) and math.isfinite(torque.tau2)


def is_slow(state: State, limit: float) -> bool:
    """Return whether both motor joints turn at the limit (rad/s) at most."""
    return abs(state.leg1.dq1) <= limit and abs(state.leg2.dq1) <= limit


def is_inside(state: State, area: Area) -> bool:
    """Return whether the platform is in an area."""
    return area.x_min <= state.x <= area.x_max and area.y_min <= state.y <= area.y_max


def is_in_reach(robot: FiveBar, state: State) -> bool:
    """Return whether the platform is where both legs reach, but for `REACH_TOLERANCE`."""
    return type1_distance(robot, state) >= -REACH_TOLERANCE


def type1_clearance(leg: Leg, mode: int) -> float:
    """Return sin q_i2 of a leg, positive on the side of its working mode: a mode of +1 has sin q_i2 < 0."""
    return -mode * leg.sin_q2


def is_clear_of_type_1(state: State, mode1: int, mode2: int, margin: float) -> bool:
    """Return whether both legs keep the margin on the side of the working mode; 0 is for motions through Type 1.

    The sign is looked at because near Type 1 a leg passes fast: from one sample to the next it may be through.
    """
    return margin <= 0.0 or (
        type1_clearance(state.leg1, mode1) >= margin and type1_clearance(state.leg2, mode2) >= margin
    )


def distance_from(state: State, x: float, y: float) -> float:
    """Return how far (m) the platform is from a place (m)."""
    return math.hypot(state.x - x, state.y - y)


def is_on_track(state: State, x: float, y: float, limit: float) -> bool:
    """Return whether the platform is within the limit (m) of the desired place (m)."""
    return distance_from(state, x, y) <= limit


def undefined(torque: Torque, sigma: float) -> Fault | None:
    """Return `torque_undefined` for a torque that is not finite; sigma is told with it."""
    if is_finite(torque):
        return None
    return Fault("torque_undefined", f"candidate torque ({torque.tau1}, {torque.tau2}) Nm, sigma = {sigma:.3f}")


def limited(torque: Torque, limit: float) -> Torque:
    """Return the torque within +-limit (Nm), motor by motor."""
    return Torque(_within(torque.tau1, 0.0, limit), _within(torque.tau2, 0.0, limit))


def rate_limited(torque: Torque, before: Torque, step: float) -> Torque:
    """Return the torque within one step (Nm) of the last command, motor by motor."""
    return Torque(_within(torque.tau1, before.tau1, step), _within(torque.tau2, before.tau2, step))


def over_speed(state: State, limit: float) -> Fault | None:
    """Return `over_speed` where a motor joint turns faster than the limit (rad/s)."""
    if is_slow(state, limit):
        return None
    speed1, speed2 = state.leg1.dq1, state.leg2.dq1
    return Fault("over_speed", f"motors at {speed1:.2f} and {speed2:.2f} rad/s, limit {limit:g} rad/s")


def out_of_workspace(robot: FiveBar, state: State, workspace: Area | None) -> Fault | None:
    """Return `out_of_workspace` where the platform is outside the given area, or beyond what both legs reach."""
    if workspace is not None and not is_inside(state, workspace):
        reason = f"workspace {list(workspace)} m"
    elif not is_in_reach(robot, state):
        beyond = -type1_distance(robot, state)
        reason = f"{beyond * 1e3:.1f} mm out of reach: the joints contradict each other"
    else:
        return None
    return Fault("out_of_workspace", f"platform at ({state.x:.4f}, {state.y:.4f}) m, {reason}")


def near_type_1(state: State, mode1: int, mode2: int, margin: float) -> Fault | None:
    """Return `near_type_1` where a leg is nearly stretched or folded, or has changed to the other working mode."""
    if is_clear_of_type_1(state, mode1, mode2, margin):
        return None
    clear1, clear2 = type1_clearance(state.leg1, mode1), type1_clearance(state.leg2, mode2)
    return Fault("near_type_1", f"sin q_i2 is {clear1:.4f} and {clear2:.4f} from Type 1, margin {margin:g}")


def tracking_lost(state: State, x: float, y: float, limit: float) -> Fault | None:
    """Return `tracking_lost` where the platform is further than the limit (m) from the desired place (m)."""
    if is_on_track(state, x, y, limit):
        return None
    error = distance_from(state, x, y)
    return Fault("tracking_lost", f"{error * 1e3:.1f} mm from the reference, limit {limit * 1e3:.1f} mm")


def fastest_motor(state: State) -> float:
    """Return the speed (rad/s) of the faster motor joint; NaN where one is not known."""
    return max(abs(state.leg1.dq1), abs(state.leg2.dq1), key=lambda speed: math.inf if math.isnan(speed) else speed)


def _within(value: float, middle: float, width: float) -> float:
    return max(middle - width, min(middle + width, value))
