# SPDX-License-Identifier: Apache-2.0
"""Where the platform can rest: which assembly mode a place belongs to, and why one is out of the question."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.kinematics import assembly_mode, state_from_platform
from fivebar_control.model.singularity import inverse_condition, type1_margin
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.safety.stages import is_inside
from fivebar_control.trajectory.refusal import out_of_reach, place
from fivebar_description.parameters import FiveBar

WORKING_MODES = ((1, -1), (-1, 1), (1, 1), (-1, -1))
"""All working modes: elbows outwards, inwards, both to the left, both to the right; seeded draws count on the order."""


class Place(NamedTuple):
    """The platform at rest in a working mode.

    Attributes:
        x, y: m.
        assembly: the assembly mode, the sign of det A.
        kappa: 1 / cond(A), 0 on the Type 2 locus.
        serial: min |sin q_i2|, 0 at Type 1; NaN out of reach, like all figures but the place.
    """

    x: float
    y: float
    assembly: int
    kappa: float
    serial: float


def place_at(robot: FiveBar, working_mode: WorkingMode, x: float, y: float) -> Place:
    """Return the figures of a rest at (x, y) m."""
    state = state_from_platform(robot, working_mode, x, y, 0.0, 0.0)
    kappa = inverse_condition(state)
    # out of reach of one leg only, the other's margin is still a number
    serial = math.nan if math.isnan(kappa) else type1_margin(state)
    return Place(x, y, assembly_mode(state), kappa, serial)


def rest_problem(robot: FiveBar, working_mode: WorkingMode, x: float, y: float, limits: MotionLimits) -> str | None:
    """Say why the platform must not rest at (x, y) m, in words; None where it may."""
    if not (math.isfinite(x) and math.isfinite(y)):
        return f"({x}, {y}) m: expected finite coordinates"
    if not is_inside(limits.workspace, x, y):
        return f"{place(x, y)} is outside the workspace {list(limits.workspace)} m, beyond which the robot is stopped"
    for number, leg in enumerate((robot.leg1, robot.leg2), start=1):
        beyond = out_of_reach(leg, number, x, y)
        if beyond is not None:
            return beyond
    there = place_at(robot, working_mode, x, y)
    # not the other way round: the comparison is false for NaN too
    if not there.serial >= limits.serial_margin:
        return (
            f"{place(x, y)} is too near the Type 1 singularity: |sin q_i2| = {there.serial:.3f},"
            f" expected at least {limits.serial_margin:g}"
        )
    if not there.kappa >= limits.rest:
        return (
            f"{place(x, y)} is too near the Type 2 singularity for a rest: 1/cond(A) = {there.kappa:.3f} in"
            f" working mode {mode_name(working_mode)}, expected at least {limits.rest:g}"
        )
    return None


def assembly_problem(
    robot: FiveBar, working_mode: WorkingMode, x: float, y: float, assembly: int, limits: MotionLimits
) -> str | None:
    """Say why a reachable place does not belong to an assembly mode in a working mode; None where it does."""
    own_assembly = place_at(robot, working_mode, x, y).assembly
    if own_assembly == assembly:
        return None
    suitable = [
        mode
        for mode in WORKING_MODES
        if rest_problem(robot, mode, x, y, limits) is None and place_at(robot, mode, x, y).assembly == assembly
    ]
    start = (
        f"{place(x, y)} has assembly mode {sign_name(own_assembly)} in working mode {mode_name(working_mode)};"
        f" assembly mode {sign_name(assembly)}"
    )
    if not suitable:
        return f"{start} is not there in any working mode"
    names = " or ".join(mode_name(mode) for mode in suitable)
    return f"{start} needs working mode {names}, which is reached only through a Type 1 singularity"


def sign_name(sign: int) -> str:
    """Return an assembly mode as a person writes it: + or -."""
    return "+" if sign > 0 else "-"


def mode_name(working_mode: WorkingMode) -> str:
    """Return a working mode as a person writes it."""
    return f"({working_mode[0]:+d}, {working_mode[1]:+d})"
