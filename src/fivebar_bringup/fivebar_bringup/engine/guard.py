"""The last decision before the drives, as `controllers.guard.Guard` takes it, with numbers for the faults' texts."""

from __future__ import annotations

import math

from fivebar_bringup.engine.case import Case, Safety
from fivebar_bringup.engine.outcome import (
    NEAR_TYPE_1,
    NO_FAULT,
    OUT_OF_WORKSPACE,
    OVER_SPEED,
    TORQUE_UNDEFINED,
    TRACKING_LOST,
)
from fivebar_control.controllers.safety import REACH_TOLERANCE, limited, rate_limited
from fivebar_control.controllers.torque import Torque
from fivebar_control.model.singularity import type1_distance
from fivebar_control.model.state import State


def fault_at(case: Case, state: State, x: float, y: float, asked: Torque) -> int:
    """Return the number of the fault that a sample shows, `NO_FAULT` for none; stages in the order of `safety`.

    Args:
        case: the case.
        state: what the controllers were told.
        x, y: where the platform should be (m).
        asked: the blended torque (Nm).
    """
    safety = case.safety
    if not (math.isfinite(asked.tau1) and math.isfinite(asked.tau2)):
        return TORQUE_UNDEFINED
    if not (abs(state.leg1.dq1) <= safety.joint_speed and abs(state.leg2.dq1) <= safety.joint_speed):
        return OVER_SPEED
    area = safety.workspace
    inside = area.x_min <= state.x <= area.x_max and area.y_min <= state.y <= area.y_max
    if not (inside and type1_distance(case.believed, state) >= -REACH_TOLERANCE):
        return OUT_OF_WORKSPACE
    clear1, clear2 = -case.mode1 * state.leg1.sin_q2, -case.mode2 * state.leg2.sin_q2
    if not (safety.type1_margin <= 0.0 or (clear1 >= safety.type1_margin and clear2 >= safety.type1_margin)):
        return NEAR_TYPE_1
    if not math.hypot(state.x - x, state.y - y) <= safety.tracking_error:
        return TRACKING_LOST
    return NO_FAULT


def allowed(safety: Safety, asked: Torque, before: Torque) -> Torque:
    """Return what the two limits leave of a torque (Nm), `before` being the last command."""
    return rate_limited(limited(asked, safety.torque_limit), before, safety.torque_step)
