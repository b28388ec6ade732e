# SPDX-License-Identifier: Apache-2.0
"""Torques that enforce a virtual constraint on the locus: one equation for two motors, in three resolutions.

On the locus only the component of the dynamics along v1 can be influenced. With w = B^-1 U_1, taking the dynamics along
U_1 leaves w^T tau = w^T (ZZ qddot + f) + m alpha / s1 for the platform acceleration alpha v1. Every resolution below
satisfies this equation; they differ in the null-space component of tau.

Residual inertias of the distal links add the motors' part of their moments to ZZ qddot and the platform's part along v1
to m alpha (`fivebar_control.model.residual`). They depend on the acceleration along t_s too, which no torque
influences: it is taken from the reference. Gravity in the plane and a constant force w_e on the platform add
-v1 . w_e to m alpha; along t_s the platform falls with t_s . w_e / m, which no torque influences either.
"""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.laws.gains import FULL_FRICTION, MIN_NORM
from fivebar_control.laws.torque import UNDEFINED, ZERO, Torque
from fivebar_control.model.residual import distal_moments, moment_torques
from fivebar_control.model.singularity import SQRT_HALF, ParallelSvd
from fivebar_control.model.state import State
from fivebar_description.parameters import (
    FiveBar,
    external_acceleration,
    external_force,
    has_external_force,
    has_residual,
)


class Enforced(NamedTuple):
    """The accelerations that enforce a constraint.

    Attributes:
        alpha: of the platform along v1 (m/s^2).
        ddq11, ddq21: of the motors, which go with it (rad/s^2).
        beta: of the platform along t_s (m/s^2); only residual inertias make a difference of it.
    """

    alpha: float
    ddq11: float
    ddq21: float
    beta: float


def resolved(
    resolution: int, robot: FiveBar, state: State, svd: ParallelSvd, enforced: Enforced, friction: Torque
) -> Torque:
    """Return the torque of one of the resolutions.

    Args:
        resolution: `MIN_NORM`, `FULL_FRICTION` or `FULL_INVERSE`.
        robot: nominal robot of the law.
        state: measured state.
        svd: decomposition of A there.
        enforced: accelerations.
        friction: of both motors (Nm).
    """
    load, alpha = _load(robot, state, svd, enforced), enforced.alpha
    if resolution == FULL_FRICTION:
        return full_friction(robot, state, svd, alpha, load, friction)
    if resolution == MIN_NORM:
        return min_norm(robot, state, svd, alpha, load, friction)
    return full_inverse(robot, state, svd, alpha, load, friction)


class Load(NamedTuple):
    """The load besides m alpha: torques (Nm) of the legs, and a force (N) of theirs on the platform along v1."""

    load1: float
    load2: float
    force: float


def _load(robot: FiveBar, state: State, svd: ParallelSvd, enforced: Enforced) -> Load:
    alpha, ddq11, ddq21, beta = enforced
    load1, load2 = robot.leg1.inertia * ddq11, robot.leg2.inertia * ddq21
    force = held_along(robot, svd) if has_external_force(robot) else 0.0
    if not has_residual(robot):
        return Load(load1, load2, force)
    leg1, leg2 = state.leg1, state.leg2
    ax, ay = alpha * svd.v_x + beta * svd.t_x, alpha * svd.v_y + beta * svd.t_y
    moments = distal_moments(robot, state, ddq11, ddq21, ax, ay)
    on1, on2 = moment_torques(robot, state, moments)
    force1 = (svd.v_y * leg1.u_x - svd.v_x * leg1.u_y) * moments.moment1 / robot.leg1.distal
    force2 = (svd.v_y * leg2.u_x - svd.v_x * leg2.u_y) * moments.moment2 / robot.leg2.distal
    return Load(load1 + on1, load2 + on2, force1 + force2 + force)


def held_along(robot: FiveBar, svd: ParallelSvd) -> float:
    """Return -v1 . w_e (N), what the legs hold along v1 of gravity and a constant force on the platform."""
    force_x, force_y = external_force(robot)
    return -(svd.v_x * force_x + svd.v_y * force_y)


def fall_along_locus(robot: FiveBar, svd: ParallelSvd) -> float:
    """Return t_s . w_e / m (m/s^2), the acceleration along t_s by gravity and a constant force."""
    fall_x, fall_y = external_acceleration(robot)
    return svd.t_x * fall_x + svd.t_y * fall_y


def min_norm(
    robot: FiveBar,
    state: State,
    svd: ParallelSvd,
    alpha: float,
    load: Load,
    friction: Torque,
) -> Torque:
    """Return the smallest torque that meets the equation: the pseudo-inverse of 3.35 with its signs corrected.

    Friction along the uncontrollable direction stays uncompensated.
    """
    rubbed = Load(load.load1 + friction.tau1, load.load2 + friction.tau2, load.force)
    return _along_w(robot, state, svd, alpha, rubbed, ZERO)


def full_friction(
    robot: FiveBar,
    state: State,
    svd: ParallelSvd,
    alpha: float,
    load: Load,
    friction: Torque,
) -> Torque:
    """Return friction compensated in both motors plus the smallest torque for the rest."""
    return _along_w(robot, state, svd, alpha, load, friction)


def full_inverse(
    robot: FiveBar,
    state: State,
    svd: ParallelSvd,
    alpha: float,
    load: Load,
    friction: Torque,
) -> Torque:
    """Return the inverse dynamics of xddot = alpha v1: lambda = U_1 m alpha / s1, exact off the locus too.

    Of the residual inertias' force on the platform only the part along v1 is met.
    """
    share = SQRT_HALF * robot.mass * alpha / svd.s1 + SQRT_HALF * load.force / svd.s1
    return Torque(
        load.load1 + friction.tau1 + state.leg1.b * share, load.load2 + friction.tau2 + state.leg2.b * share * svd.fold
    )


def _along_w(
    robot: FiveBar,
    state: State,
    svd: ParallelSvd,
    alpha: float,
    load: Load,
    apart: Torque,
) -> Torque:
    """Return apart + w (w^T w)^-1 [w^T load + (m alpha + force) / s1]."""
    if state.leg1.b == 0.0 or state.leg2.b == 0.0:
        return UNDEFINED
    w1, w2 = SQRT_HALF / state.leg1.b, SQRT_HALF * svd.fold / state.leg2.b
    along = w1 * load.load1 + w2 * load.load2 + robot.mass * alpha / svd.s1 + load.force / svd.s1
    scale = along / (w1 * w1 + w2 * w2)
    return Torque(apart.tau1 + w1 * scale, apart.tau2 + w2 * scale)
