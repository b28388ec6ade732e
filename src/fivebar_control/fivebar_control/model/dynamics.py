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


class DynamicResponse(NamedTuple):
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


class ConstraintForm(NamedTuple):
    """The matrix K of the constraint form K lambda = B ZZ^-1 (tau - f) - c, symmetric, and what it is made of.

    K = A A^T / m + B ZZ^-1 B.

    Attributes:
        k11, k12, k22: entries of K (1/kg).
        per_mass: 1 / m (1/kg).
        per_zz1, per_zz2: diagonal of ZZ^-1 (1/(kg m^2)).
        lever1, lever2: diagonal of ZZ^-1 B (1/(kg m)).
    """

    k11: float
    k12: float
    k22: float
    per_mass: float
    per_zz1: float
    per_zz2: float
    lever1: float
    lever2: float


def constraint_form(robot: FiveBar, state: State) -> ConstraintForm:
    """Return the constraint form of the direct dynamics; regular on the Type 1 and Type 2 loci."""
    leg1, leg2 = state.leg1, state.leg2
    # divisions are slow, and these are the same for a whole run: a compiler takes them out of its loops
    per_mass, per_zz1, per_zz2 = 1.0 / robot.mass, 1.0 / robot.leg1.inertia, 1.0 / robot.leg2.inertia
    lever1, lever2 = per_zz1 * leg1.b, per_zz2 * leg2.b
    return ConstraintForm(
        k11=per_mass + leg1.b * lever1,
        k12=per_mass * (leg1.u_x * leg2.u_x + leg1.u_y * leg2.u_y),
        k22=per_mass + leg2.b * lever2,
        per_mass=per_mass,
        per_zz1=per_zz1,
        per_zz2=per_zz2,
        lever1=lever1,
        lever2=lever2,
    )


def direct_dynamics(robot: FiveBar, state: State, tau1: float, tau2: float, f1: float, f2: float) -> DynamicResponse:
    """Return the motion under motor torques (Nm), from the constraint form.

    (A A^T / m + B ZZ^-1 B) lambda = B ZZ^-1 (tau - f) - c, then qddot = ZZ^-1 (tau - f - B lambda) and
    xddot = A^T lambda / m. Regular on the Type 1 and Type 2 loci; NaN only where both legs are folded or stretched on
    the Type 2 locus: the determinant there is (beta1 + beta2) / m + beta1 beta2 with beta_i = b_i^2 / zz_i.
    """
    leg1, leg2 = state.leg1, state.leg2
    form = constraint_form(robot, state)
    determinant = form.k11 * form.k22 - form.k12 * form.k12
    if determinant <= 0.0:
        return DynamicResponse(NAN, NAN, NAN, NAN, NAN, NAN)
    inverse = 1.0 / determinant
    drive1, drive2 = form.per_zz1 * (tau1 - f1), form.per_zz2 * (tau2 - f2)
    right1, right2 = leg1.b * drive1 - leg1.c, leg2.b * drive2 - leg2.c
    lambda1 = inverse * (form.k22 * right1 - form.k12 * right2)
    lambda2 = inverse * (form.k11 * right2 - form.k12 * right1)
    return DynamicResponse(
        ddq11=drive1 - form.lever1 * lambda1,
        ddq21=drive2 - form.lever2 * lambda2,
        ax=form.per_mass * (leg1.u_x * lambda1 + leg2.u_x * lambda2),
        ay=form.per_mass * (leg1.u_y * lambda1 + leg2.u_y * lambda2),
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
    return platform_model_of_rows(
        robot,
        leg1.u_x / leg1.b,
        leg1.u_y / leg1.b,
        leg1.c / leg1.b,
        leg2.u_x / leg2.b,
        leg2.u_y / leg2.b,
        leg2.c / leg2.b,
    )


def platform_model_of_rows(
    robot: FiveBar, n1_x: float, n1_y: float, drift1: float, n2_x: float, n2_y: float, drift2: float
) -> PlatformModel:
    """Return the model from the rows of N (rad/m) and the motor accelerations c_i / b_i (rad/s^2) for xddot = 0."""
    zz1, zz2 = robot.leg1.inertia, robot.leg2.inertia
    load1, load2 = zz1 * drift1, zz2 * drift2
    return PlatformModel(
        m_xx=robot.mass + zz1 * n1_x * n1_x + zz2 * n2_x * n2_x,
        m_xy=zz1 * n1_x * n1_y + zz2 * n2_x * n2_y,
        m_yy=robot.mass + zz1 * n1_y * n1_y + zz2 * n2_y * n2_y,
        h_x=n1_x * load1 + n2_x * load2,
        h_y=n1_y * load1 + n2_y * load2,
        n1_x=n1_x,
        n1_y=n1_y,
        n2_x=n2_x,
        n2_y=n2_y,
    )


def direct_dynamics_of_platform(
    robot: FiveBar, state: State, tau1: float, tau2: float, f1: float, f2: float
) -> tuple[float, float]:
    """Return xddot (m/s^2) under motor torques (Nm), from the platform form; NaN at Type 1."""
    return platform_motion(platform_model(robot, state), tau1 - f1, tau2 - f2)


def platform_motion(model: PlatformModel, drive1: float, drive2: float) -> tuple[float, float]:
    """Return xddot (m/s^2) under motor torques without friction (Nm): M^-1 (N^T (tau - f) - h)."""
    right_x = model.n1_x * drive1 + model.n2_x * drive2 - model.h_x
    right_y = model.n1_y * drive1 + model.n2_y * drive2 - model.h_y
    determinant = model.m_xx * model.m_yy - model.m_xy * model.m_xy
    return (
        (model.m_yy * right_x - model.m_xy * right_y) / determinant,
        (model.m_xx * right_y - model.m_xy * right_x) / determinant,
    )
