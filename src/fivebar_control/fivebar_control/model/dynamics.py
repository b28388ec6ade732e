# SPDX-License-Identifier: Apache-2.0
"""Inverse and direct dynamics (1.30, 1.31): tau = ZZ qddot + B lambda + f, A^T lambda = m xddot.

Residual inertias of the distal links add the terms of :mod:`fivebar_control.model.residual`, where a robot has them.

The printed B^T lambda equals B lambda since B is diagonal. Gravity in the robot's plane and a constant force add w_e to
the platform, A^T lambda + w_e = m xddot; what the motors take for the weight of the legs is part of f. The direct model
has two forms: the constraint form is regular at Types 1 and 2, the platform form (in x) at Type 2.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.constraint_form import DynamicResponse, constraint_form, pushed, response_to
from fivebar_control.model.kinematics import det_a, distal_acceleration, joint_acceleration, platform_acceleration
from fivebar_control.model.residual import (
    distal_moments,
    moment_multipliers,
    moment_torques,
    with_residuals,
)
from fivebar_control.model.state import Leg, State
from fivebar_description.parameters import FiveBar, LegParameters, external_acceleration, external_force, has_residual

NAN = math.nan


def multipliers(robot: FiveBar, state: State, ax: float, ay: float) -> tuple[float, float]:
    """Return lambda = A^-T (m xddot - w_e) (N), the forces along the distal links (1.31); NaN on the locus (1.18)."""
    determinant = det_a(state)
    if determinant == 0.0:
        return NAN, NAN
    fall_x, fall_y = external_acceleration(robot)
    ax, ay = ax - fall_x, ay - fall_y
    leg1, leg2 = state.leg1, state.leg2
    scale = robot.mass / determinant
    return scale * (leg2.u_y * ax - leg2.u_x * ay), scale * (leg1.u_x * ay - leg1.u_y * ax)


def inverse_dynamics(
    robot: FiveBar, state: State, ddq11: float, ddq21: float, f1: float, f2: float
) -> tuple[float, float]:
    """Return the motor torques (Nm) for motor accelerations (rad/s^2) and lost torque f (Nm); NaN on the locus."""
    return _torques(robot, state, (ddq11, ddq21), platform_acceleration(state, ddq11, ddq21), f1, f2)


def inverse_dynamics_of_platform(
    robot: FiveBar, state: State, ax: float, ay: float, f1: float, f2: float
) -> tuple[float, float]:
    """Return the motor torques (Nm) for a platform acceleration (m/s^2); NaN on the locus and at Type 1."""
    motors = joint_acceleration(state.leg1, ax, ay), joint_acceleration(state.leg2, ax, ay)
    return _torques(robot, state, motors, (ax, ay), f1, f2)


def _torques(
    robot: FiveBar, state: State, motors: tuple[float, float], platform: tuple[float, float], f1: float, f2: float
) -> tuple[float, float]:
    (ddq11, ddq21), (ax, ay) = motors, platform
    lambda1, lambda2 = multipliers(robot, state, ax, ay)
    if has_residual(robot) and not math.isnan(lambda1):
        moments = distal_moments(robot, state, ddq11, ddq21, ax, ay)
        more1, more2 = moment_multipliers(robot, state, moments)
        lambda1, lambda2 = lambda1 + more1, lambda2 + more2
        on1, on2 = moment_torques(robot, state, moments)
        f1, f2 = f1 + on1, f2 + on2
    return (
        robot.leg1.inertia * ddq11 + state.leg1.b * lambda1 + f1,
        robot.leg2.inertia * ddq21 + state.leg2.b * lambda2 + f2,
    )


def direct_dynamics(robot: FiveBar, state: State, tau1: float, tau2: float, f1: float, f2: float) -> DynamicResponse:
    """Return the motion under motor torques (Nm), from the constraint form.

    (A A^T / m + B ZZ^-1 B) lambda = B ZZ^-1 (tau - f) - c - A w_e / m, then qddot = ZZ^-1 (tau - f - B lambda) and
    xddot = (A^T lambda + w_e) / m. Regular on the Type 1 and Type 2 loci; NaN only where both legs are folded or
    stretched on the Type 2 locus: there the determinant is (beta1 + beta2) / m + beta1 beta2 with
    beta_i = b_i^2 / zz_i.
    """
    form = constraint_form(robot, state)
    leg1, leg2 = state.leg1, state.leg2
    drive1, drive2 = form.per_zz1 * (tau1 - f1), form.per_zz2 * (tau2 - f2)
    right = pushed(robot, state, leg1.b * drive1 - leg1.c, leg2.b * drive2 - leg2.c)
    response = response_to(form, state, drive1, drive2, right)
    return with_residuals(robot, state, form, response, 1.0) if has_residual(robot) else response


class PlatformModel(NamedTuple):
    """The model in platform coordinates, M xddot + h = N^T (tau - f), with N = B^-1 A (2x2, rows n1, n2).

    M = m I + N^T ZZ N + P^T ZZ_2 P is symmetric and never loses rank, P with rows p_i, dtheta_i = p_i . xdot;
    h = N^T ZZ B^-1 c + P^T ZZ_2 e - w_e with e the distal accelerations for xddot = 0; only N^T loses rank on the
    locus.
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
    model = platform_model_of_rows(
        robot,
        leg1.u_x / leg1.b,
        leg1.u_y / leg1.b,
        leg1.c / leg1.b,
        leg2.u_x / leg2.b,
        leg2.u_y / leg2.b,
        leg2.c / leg2.b,
    )
    if has_residual(robot):
        return with_residual_rows(robot, model, distal_row(robot.leg1, leg1), distal_row(robot.leg2, leg2))
    return model


class DistalRow(NamedTuple):
    """Motion of a distal link, d2 theta_i / dt2 = p . xddot + drift: p in rad/m, drift in rad/s^2."""

    p_x: float
    p_y: float
    drift: float


def distal_row(parameters: LegParameters, leg: Leg) -> DistalRow:
    """Return the row of a leg; NaN at Type 1."""
    if leg.sin_q2 == 0.0:
        return DistalRow(NAN, NAN, NAN)
    lever = -1.0 / (parameters.distal * leg.sin_q2)
    return DistalRow(lever * leg.r_x, lever * leg.r_y, distal_acceleration(parameters, leg, 0.0, 0.0))


def with_residual_rows(robot: FiveBar, model: PlatformModel, row1: DistalRow, row2: DistalRow) -> PlatformModel:
    """Return the model with the residual inertias, whose links move by these rows."""
    zz1, zz2 = robot.leg1.residual, robot.leg2.residual
    load1, load2 = zz1 * row1.drift, zz2 * row2.drift
    return PlatformModel(
        m_xx=model.m_xx + zz1 * row1.p_x * row1.p_x + zz2 * row2.p_x * row2.p_x,
        m_xy=model.m_xy + zz1 * row1.p_x * row1.p_y + zz2 * row2.p_x * row2.p_y,
        m_yy=model.m_yy + zz1 * row1.p_y * row1.p_y + zz2 * row2.p_y * row2.p_y,
        h_x=model.h_x + row1.p_x * load1 + row2.p_x * load2,
        h_y=model.h_y + row1.p_y * load1 + row2.p_y * load2,
        n1_x=model.n1_x,
        n1_y=model.n1_y,
        n2_x=model.n2_x,
        n2_y=model.n2_y,
    )


def platform_model_of_rows(
    robot: FiveBar, n1_x: float, n1_y: float, drift1: float, n2_x: float, n2_y: float, drift2: float
) -> PlatformModel:
    """Return the model without residual inertias.

    From the rows of N (rad/m) and the motor accelerations c_i / b_i (rad/s^2) for xddot = 0.
    """
    zz1, zz2 = robot.leg1.inertia, robot.leg2.inertia
    load1, load2 = zz1 * drift1, zz2 * drift2
    force_x, force_y = external_force(robot)
    return PlatformModel(
        m_xx=robot.mass + zz1 * n1_x * n1_x + zz2 * n2_x * n2_x,
        m_xy=zz1 * n1_x * n1_y + zz2 * n2_x * n2_y,
        m_yy=robot.mass + zz1 * n1_y * n1_y + zz2 * n2_y * n2_y,
        h_x=n1_x * load1 + n2_x * load2 - force_x,
        h_y=n1_y * load1 + n2_y * load2 - force_y,
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


def platform_motion(
    model: PlatformModel, drive1: float, drive2: float, fx: float = 0.0, fy: float = 0.0
) -> tuple[float, float]:
    """Return xddot (m/s^2) under motor torques without friction (Nm) and a force (N): M^-1 (N^T (tau - f) + F - h)."""
    right_x = model.n1_x * drive1 + model.n2_x * drive2 - (model.h_x - fx)
    right_y = model.n1_y * drive1 + model.n2_y * drive2 - (model.h_y - fy)
    determinant = model.m_xx * model.m_yy - model.m_xy * model.m_xy
    return (
        (model.m_yy * right_x - model.m_xy * right_y) / determinant,
        (model.m_xx * right_y - model.m_xy * right_x) / determinant,
    )
