"""The last decision before the drives, as `safety.guard.Guard` takes it, with numbers for the faults' texts."""

from __future__ import annotations

from fivebar_bringup.simulation.case import Case, Safety
from fivebar_bringup.simulation.outcome import (
    NEAR_TYPE_1,
    NO_FAULT,
    OUT_OF_WORKSPACE,
    OVER_SPEED,
    TORQUE_UNDEFINED,
    TRACKING_LOST,
)
from fivebar_control.laws.torque import Torque
from fivebar_control.model.state import State
from fivebar_control.safety.stages import (
    is_clear_of_type_1,
    is_finite,
    is_in_reach,
    is_inside,
    is_on_track,
    is_slow,
    limited,
    rate_limited,
)


def fault_at(case: Case, state: State, x: float, y: float, asked: Torque) -> int:
    """Return the number of the fault that a sample shows, `NO_FAULT` for none; stages in the order of `safety`.

    Args:
        case: the case.
        state: what the controllers were told.
        x, y: where the platform should be (m).
        asked: the blended torque (Nm).
    """
    safety = case.safety
    if not is_finite(asked):
        return TORQUE_UNDEFINED
    if not is_slow(state, safety.joint_speed):
        return OVER_SPEED
    if not (is_inside(state, safety.workspace) and is_in_reach(case.believed, state)):
        return OUT_OF_WORKSPACE
    if not is_clear_of_type_1(state, case.mode1, case.mode2, safety.type1_margin):
        return NEAR_TYPE_1
    if not is_on_track(state, x, y, safety.tracking_error):
        return TRACKING_LOST
    return NO_FAULT


def allowed(safety: Safety, asked: Torque, before: Torque) -> Torque:
    """Return what the two limits leave of a torque (Nm), `before` being the last command."""
    return rate_limited(limited(asked, safety.torque_limit), before, safety.torque_step)
