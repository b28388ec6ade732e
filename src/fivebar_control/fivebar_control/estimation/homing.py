# SPDX-License-Identifier: Apache-2.0
"""Initialisation of the filter: the declared homing posture, checked against the encoders."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.geometry import direct_geometry, inverse_geometry, wrap
from fivebar_control.model.kinematics import assembly_mode, state_from_motors, state_from_platform, working_mode
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import WorkingMode
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError

MIN_HOMING_KAPPA = 0.1
"""Least 1/cond(A) of a homing posture: nearer to the locus the encoders do not determine the assembly mode."""


SEEN_TOLERANCE = 0.005
"""Largest distance (m) between the platform by the camera and by the encoders at the start."""

SEEN_APART = 2.0
"""Least distance of the other assembly mode, in units of such distances."""


class HomingContradicted(InputError):
    """The declared posture is impossible or contradicts the encoders."""


class Homing(NamedTuple):
    """The declared posture: platform (m), elbow side of each leg, and the sign of det A."""

    x: float
    y: float
    mode: WorkingMode
    assembly: int


def homing_at(robot: FiveBar, mode: WorkingMode, x: float, y: float) -> Homing:
    """Return the posture with the platform at (x, y) m in a working mode, in the assembly mode that belongs to it."""
    return Homing(x, y, mode, assembly_mode(state_from_platform(robot, mode, x, y, 0.0, 0.0)))


def check_declared(robot: FiveBar, homing: Homing) -> None:
    """Refuse a posture that contradicts itself.

    Raises:
        HomingContradicted: out of reach, too near to the Type 2 locus, or in the other assembly mode.
    """
    place = f"({homing.x:.4f}, {homing.y:.4f}) m"
    state = state_from_platform(robot, homing.mode, homing.x, homing.y, 0.0, 0.0)
    if not math.isfinite(state.leg1.dq1 + state.leg2.dq1):
        raise HomingContradicted(f"homing_contradicted: {place} is out of reach")
    kappa = inverse_condition(state)
    if kappa < MIN_HOMING_KAPPA:
        raise HomingContradicted(
            f"homing_contradicted: at {place} the assembly mode is ambiguous: 1/cond(A) = {kappa:.3f},"
            f" expected at least {MIN_HOMING_KAPPA}; `fivebar posture` shows the way out"
        )
    if assembly_mode(state) != homing.assembly:
        raise HomingContradicted(
            f"homing_contradicted: at {place} in working mode {list(homing.mode)} the assembly mode is"
            f" {-homing.assembly}, declared is {homing.assembly}"
        )


def seen_assembly(robot: FiveBar, q11: float, q21: float, x: float, y: float) -> int:
    """Return the assembly mode of a platform that was seen at (x, y) m, with both motor angles (rad).

    Raises:
        HomingContradicted: no assembly mode of these angles has the platform there, or both have.
    """
    places = {assembly: direct_geometry(robot, assembly, q11, q21) for assembly in (1, -1)}
    distances = {assembly: math.hypot(at[0] - x, at[1] - y) for assembly, at in places.items()}
    near = min(distances, key=lambda assembly: distances[assembly] if distances[assembly] >= 0.0 else math.inf)
    if not distances[near] <= SEEN_TOLERANCE:
        raise HomingContradicted(
            f"homing_contradicted: the camera sees the platform at ({x:.4f}, {y:.4f}) m, {1e3 * distances[near]:.1f} mm"
            f" from where the encoders have it, allowed are {1e3 * SEEN_TOLERANCE:g} mm"
        )
    if not distances[-near] > SEEN_APART * SEEN_TOLERANCE:
        raise HomingContradicted(
            f"homing_contradicted: at ({x:.4f}, {y:.4f}) m both assembly modes are within"
            f" {1e3 * SEEN_APART * SEEN_TOLERANCE:g} mm of what the camera sees"
        )
    return near


def seen_posture(robot: FiveBar, q11: float, q21: float, x: float, y: float) -> Homing:
    """Return the posture of a robot at rest from both motor angles (rad) and the platform as a camera sees it (m).

    The camera shows the modes; where exactly the platform is follows from the motors, as everywhere else.

    Raises:
        HomingContradicted: no assembly mode of these angles has the platform there, or both have.
    """
    assembly = seen_assembly(robot, q11, q21, x, y)
    state = state_from_motors(robot, assembly, q11, q21, 0.0, 0.0)
    mode = working_mode(state)
    return Homing(state.x, state.y, mode, assembly)


def check_encoders(robot: FiveBar, homing: Homing, tolerance: float, q11: float, q21: float) -> None:
    """Refuse first angles (rad) of both motors that contradict the declared posture.

    Raises:
        HomingContradicted: an angle is further than the tolerance (rad) from that of the declared posture.
    """
    expected = inverse_geometry(robot, homing.mode, homing.x, homing.y)
    for name, angle, declared in (("q11", q11, expected.q11), ("q21", q21, expected.q21)):
        difference = wrap(angle - declared)
        if not abs(difference) <= tolerance:
            raise HomingContradicted(
                f"homing_contradicted: {name} reads {angle:.4f} rad, {difference:+.4f} rad from the declared posture,"
                f" allowed are {tolerance:g} rad"
            )
