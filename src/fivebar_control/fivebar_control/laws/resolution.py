"""Torques that enforce a virtual constraint on the locus: one equation for two motors, in three resolutions.

On the locus only the component of the dynamics along v1 can be influenced. With w = B^-1 U_1, taking the dynamics along
U_1 leaves w^T tau = w^T (ZZ qddot + f) + m alpha / s1 for the platform acceleration alpha v1. Every resolution below
satisfies this equation; they differ in the null-space component of tau.
"""

from __future__ import annotations

from fivebar_control.laws.torque import UNDEFINED, Torque
from fivebar_control.model.singularity import SQRT_HALF, ParallelSvd
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar

MIN_NORM, FULL_FRICTION, FULL_INVERSE = 0, 1, 2

RESOLUTIONS = {"min_norm": MIN_NORM, "full_friction": FULL_FRICTION, "full_inverse": FULL_INVERSE}
"""The resolutions by name, in the order of their numbers."""


def resolved(
    resolution: int,
    robot: FiveBar,
    state: State,
    svd: ParallelSvd,
    alpha: float,
    ddq11: float,
    ddq21: float,
    f1: float,
    f2: float,
) -> Torque:
    """Return the torque of one of the resolutions.

    Args:
        resolution: `MIN_NORM`, `FULL_FRICTION` or `FULL_INVERSE`.
        robot: nominal robot of the law.
        state: measured state.
        svd: decomposition of A there.
        alpha: platform acceleration along v1 (m/s^2).
        ddq11, ddq21: motor accelerations that go with it (rad/s^2).
        f1, f2: friction (Nm).
    """
    if resolution == FULL_FRICTION:
        return full_friction(robot, state, svd, alpha, ddq11, ddq21, f1, f2)
    if resolution == MIN_NORM:
        return min_norm(robot, state, svd, alpha, ddq11, ddq21, f1, f2)
    return full_inverse(robot, state, svd, alpha, ddq11, ddq21, f1, f2)


def min_norm(
    robot: FiveBar,
    state: State,
    svd: ParallelSvd,
    alpha: float,
    ddq11: float,
    ddq21: float,
    f1: float,
    f2: float,
) -> Torque:
    """Return the smallest torque that meets the equation: the pseudo-inverse of 3.35 with its signs corrected.

    Friction along the uncontrollable direction stays uncompensated.
    """
    return _along_w(
        robot,
        state,
        svd,
        alpha,
        robot.leg1.inertia * ddq11 + f1,
        robot.leg2.inertia * ddq21 + f2,
        0.0,
        0.0,
    )


def full_friction(
    robot: FiveBar,
    state: State,
    svd: ParallelSvd,
    alpha: float,
    ddq11: float,
    ddq21: float,
    f1: float,
    f2: float,
) -> Torque:
    """Return friction compensated in both motors plus the smallest torque for the rest."""
    return _along_w(robot, state, svd, alpha, robot.leg1.inertia * ddq11, robot.leg2.inertia * ddq21, f1, f2)


def full_inverse(
    robot: FiveBar,
    state: State,
    svd: ParallelSvd,
    alpha: float,
    ddq11: float,
    ddq21: float,
    f1: float,
    f2: float,
) -> Torque:
    """Return the inverse dynamics of xddot = alpha v1: lambda = U_1 m alpha / s1, exact off the locus too."""
    share = SQRT_HALF * robot.mass * alpha / svd.s1
    return Torque(
        robot.leg1.inertia * ddq11 + f1 + state.leg1.b * share,
        robot.leg2.inertia * ddq21 + f2 + state.leg2.b * share * svd.fold,
    )


def _along_w(
    robot: FiveBar,
    state: State,
    svd: ParallelSvd,
    alpha: float,
    load1: float,
    load2: float,
    apart1: float,
    apart2: float,
) -> Torque:
    """Return apart + w (w^T w)^-1 [w^T load + m alpha / s1]."""
    if state.leg1.b == 0.0 or state.leg2.b == 0.0:
        return UNDEFINED
    w1, w2 = SQRT_HALF / state.leg1.b, SQRT_HALF * svd.fold / state.leg2.b
    scale = (w1 * load1 + w2 * load2 + robot.mass * alpha / svd.s1) / (w1 * w1 + w2 * w2)
    return Torque(apart1 + w1 * scale, apart2 + w2 * scale)
