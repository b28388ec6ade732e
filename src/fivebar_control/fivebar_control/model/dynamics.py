"""Inverse and direct dynamics (1.30, 1.31): tau = ZZ qddot + B lambda + f, A^T lambda = m xddot.

The printed B^T lambda equals B lambda since B is diagonal. The robot lies in a horizontal plane: no gravity. The direct
model has two forms: the constraint form is regular at Types 1 and 2, the platform form (in x) at Type 2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.kinematics import det_a, joint_acceleration, platform_acceleration
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar

NAN = math.nan


class Motion(NamedTuple):
    """Accelerations and multipliers: qddot (rad/s^2), xddot (m/s^2), lambda (N)."""

    ddq11: float
    ddq21: float
    ax: float
    ay: float
    lambda1: float
    lambda2: float


def multipliers(robot: FiveBar, state: State, ax: float, ay: float) -> tuple[float, float]:
    """Return lambda = A^-T m xddot (N), the forces along the distal links (1.31); NaN on the locus (1.18)."""
    determinant = det_a(state)
    if determinant == 0.0:
        return NAN, NAN
    leg1, leg2 = state.leg1, state.leg2
    scale = robot.mass / determinant
    return scale * (leg2.u_y * ax - leg2.u_x * ay), scale * (leg1.u_x * ay - leg1.u_y * ax)


def inverse_dynamics(
    robot: FiveBar, state: State, ddq11: float, ddq21: float, f1: float, f2: float
) -> tuple[float, float]:
    """Return the motor torques (Nm) for motor accelerations (rad/s^2) and friction f (Nm); NaN on the locus."""
    ax, ay = platform_acceleration(state, ddq11, ddq21)
    lambda1, lambda2 = multipliers(robot, state, ax, ay)
    return (
        robot.leg1.inertia * ddq11 + state.leg1.b * lambda1 + f1,
        robot.leg2.inertia * ddq21 + state.leg2.b * lambda2 + f2,
    )


def inverse_dynamics_of_platform(
    robot: FiveBar, state: State, ax: float, ay: float, f1: float, f2: float
) -> tuple[float, float]:
    """Return the motor torques (Nm) for a platform acceleration (m/s^2); NaN on the locus and at Type 1."""
    lambda1, lambda2 = multipliers(robot, state, ax, ay)
    return (
        robot.leg1.inertia * joint_acceleration(state.leg1, ax, ay) + state.leg1.b * lambda1 + f1,
        robot.leg2.inertia * joint_acceleration(state.leg2, ax, ay) + state.leg2.b * lambda2 + f2,
    )


def direct_dynamics(robot: FiveBar, state: State, tau1: float, tau2: float, f1: float, f2: float) -> Motion:
    """Return the motion under motor torques (Nm), from the constraint form.

    (A A^T / m + B ZZ^-1 B) lambda = B ZZ^-1 (tau - f) - c, then qddot = ZZ^-1 (tau - f - B lambda) and
    xddot = A^T lambda / m. Regular on the Type 1 and Type 2 loci; NaN only where both legs are folded or stretched on
    the Type 2 locus: the determinant there is (beta1 + beta2) / m + beta1 beta2 with beta_i = b_i^2 / zz_i.
    """
    leg1, leg2 = state.leg1, state.leg2
    # divisions are slow, and most of these are the same for a whole run: a compiler takes them out of its loops
    per_mass, per_zz1, per_zz2 = 1.0 / robot.mass, 1.0 / robot.leg1.inertia, 1.0 / robot.leg2.inertia
    drive1, drive2 = per_zz1 * (tau1 - f1), per_zz2 * (tau2 - f2)
    lever1, lever2 = per_zz1 * leg1.b, per_zz2 * leg2.b
    m11, m22 = per_mass + leg1.b * lever1, per_mass + leg2.b * lever2
    m12 = per_mass * (leg1.u_x * leg2.u_x + leg1.u_y * leg2.u_y)
    right1, right2 = leg1.b * drive1 - leg1.c, leg2.b * drive2 - leg2.c
    determinant = m11 * m22 - m12 * m12
    if determinant <= 0.0:
        return Motion(NAN, NAN, NAN, NAN, NAN, NAN)
    inverse = 1.0 / determinant
    lambda1, lambda2 = inverse * (m22 * right1 - m12 * right2), inverse * (m11 * right2 - m12 * right1)
    return Motion(
        ddq11=drive1 - lever1 * lambda1,
        ddq21=drive2 - lever2 * lambda2,
        ax=per_mass * (leg1.u_x * lambda1 + leg2.u_x * lambda2),
        ay=per_mass * (leg1.u_y * lambda1 + leg2.u_y * lambda2),
        lambda1=lambda1,
        lambda2=lambda2,
    )


class PlatformModel(NamedTuple):
    """The model in platform coordinates, M xddot + h = N^T (tau - f), with N = B^-1 A (2x2, rows n1, n2).

    M = m I + N^T ZZ N is symmetric and never loses rank; h = N^T ZZ B^-1 c; only N^T loses rank on the locus.
    """

    m_xx: float
    m_xy: float
    m_yy: float
    h_x: float
    h_y: float
    n1_x: float
    n1_y: float
    n2_x: float
    n2_y: float


def platform_model(robot: FiveBar, state: State) -> PlatformModel:
    """Return the model in platform coordinates; regular on the Type 2 locus, NaN at Type 1."""
    leg1, leg2 = state.leg1, state.leg2
    if leg1.b == 0.0 or leg2.b == 0.0:
        return PlatformModel(NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN, NAN)
    n1_x, n1_y = leg1.u_x / leg1.b, leg1.u_y / leg1.b
    n2_x, n2_y = leg2.u_x / leg2.b, leg2.u_y / leg2.b
    zz1, zz2 = robot.leg1.inertia, robot.leg2.inertia
    drift1, drift2 = zz1 * leg1.c / leg1.b, zz2 * leg2.c / leg2.b
    return PlatformModel(
        m_xx=robot.mass + zz1 * n1_x * n1_x + zz2 * n2_x * n2_x,
        m_xy=zz1 * n1_x * n1_y + zz2 * n2_x * n2_y,
        m_yy=robot.mass + zz1 * n1_y * n1_y + zz2 * n2_y * n2_y,
        h_x=n1_x * drift1 + n2_x * drift2,
        h_y=n1_y * drift1 + n2_y * drift2,
        n1_x=n1_x,
        n1_y=n1_y,
        n2_x=n2_x,
        n2_y=n2_y,
    )


def direct_dynamics_of_platform(
    robot: FiveBar, state: State, tau1: float, tau2: float, f1: float, f2: float
) -> tuple[float, float]:
    """Return xddot (m/s^2) under motor torques (Nm), from the platform form; NaN at Type 1."""
    model = platform_model(robot, state)
    drive1, drive2 = tau1 - f1, tau2 - f2
    right_x = model.n1_x * drive1 + model.n2_x * drive2 - model.h_x
    right_y = model.n1_y * drive1 + model.n2_y * drive2 - model.h_y
    determinant = model.m_xx * model.m_yy - model.m_xy * model.m_xy
    return (
        (model.m_yy * right_x - model.m_xy * right_y) / determinant,
        (model.m_xx * right_y - model.m_xy * right_x) / determinant,
    )
