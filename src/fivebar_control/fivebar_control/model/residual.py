# SPDX-License-Identifier: Apache-2.0
"""Residual inertias of the distal links: what a rigid link is beyond two point masses at its ends.

With M_i = zz_i2R d2 theta_i / dt2 and dtheta_i = p_i . xdot, p_i = -r_i / (l_i2 sin q_i2), the balance of the platform
gets the force M_i p_i. p_i is unbounded at Type 1. In joint space it is not: across the distal link
l_i2 dtheta_i = v_i . xdot - l_i1 cos(q_i2) dq_i1 with v_i = (-u_iy, u_ix), so that M_i acts as the torque
M_i l_i1 cos(q_i2) / l_i2 on the motor and as the force -v_i M_i / l_i2 on the platform, in any posture.

Without residual inertias nothing here takes part in a computation, and results are those of the reduced model bit for
bit.
"""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.model.constraint_form import ConstraintForm, DynamicResponse, Pushed, response_to
from fivebar_control.model.kinematics import det_a, distal_acceleration_by_motor
from fivebar_control.model.state import Leg, State
from fivebar_description.parameters import FiveBar, LegParameters


class DistalMoments(NamedTuple):
    """Moments M_i (Nm) that turn the distal links' residual inertias."""

    moment1: float
    moment2: float


def moment_ratio(parameters: LegParameters, leg: Leg) -> float:
    """Return l_i1 cos(q_i2) / l_i2, the torque on the motor per moment on the distal link."""
    return parameters.proximal * leg.cos_q2 / parameters.distal


def distal_moments(robot: FiveBar, state: State, ddq11: float, ddq21: float, ax: float, ay: float) -> DistalMoments:
    """Return the moments for accelerations of motors (rad/s^2) and platform (m/s^2); regular at Type 1."""
    return DistalMoments(
        robot.leg1.residual * distal_acceleration_by_motor(robot.leg1, state.leg1, ddq11, ax, ay),
        robot.leg2.residual * distal_acceleration_by_motor(robot.leg2, state.leg2, ddq21, ax, ay),
    )


def moment_multipliers(robot: FiveBar, state: State, moments: DistalMoments) -> tuple[float, float]:
    """Return what the moments (Nm) add to lambda (N): A^-T of the forces v_i M_i / l_i2; infinite on the locus."""
    leg1, leg2 = state.leg1, state.leg2
    force1, force2 = moments.moment1 / robot.leg1.distal, moments.moment2 / robot.leg2.distal
    aligned, determinant = leg1.u_x * leg2.u_x + leg1.u_y * leg2.u_y, det_a(state)
    return -(aligned * force1 + force2) / determinant, (force1 + aligned * force2) / determinant


def moment_torques(robot: FiveBar, state: State, moments: DistalMoments) -> tuple[float, float]:
    """Return the motor torques (Nm) that go with the moments (Nm) besides those of lambda."""
    return (
        -moment_ratio(robot.leg1, state.leg1) * moments.moment1,
        -moment_ratio(robot.leg2, state.leg2) * moments.moment2,
    )


def with_residuals(
    robot: FiveBar, state: State, form: ConstraintForm, response: DynamicResponse, drift: float
) -> DynamicResponse:
    """Return the response of the robot with residual inertias from that of the robot without them.

    The moments M act on the robot without them as a load. Its distal accelerations are t + D M with t those of the
    response, so that M = ZZ_2 (t + D M), two equations. Regular wherever the response is, since the mass matrix is
    positive definite.

    Args:
        robot: its parameters.
        state: legs with their rates.
        form: the constraint form there.
        response: to the motors' torques, without residual inertias.
        drift: 1 for a response at the state's rates, 0 for one that is proportional to a torque.
    """
    leg1, leg2 = state.leg1, state.leg2
    ratio1, ratio2 = moment_ratio(robot.leg1, leg1), moment_ratio(robot.leg2, leg2)
    per_l1, per_l2 = 1.0 / robot.leg1.distal, 1.0 / robot.leg2.distal
    across = form.per_mass * det_a(state)
    response1 = response_to(
        form,
        state,
        form.per_zz1 * ratio1,
        0.0,
        Pushed(
            form.lever1 * ratio1,
            across * per_l1,
            form.per_mass * per_l1 * leg1.u_y,
            -form.per_mass * per_l1 * leg1.u_x,
        ),
    )
    response2 = response_to(
        form,
        state,
        0.0,
        form.per_zz2 * ratio2,
        Pushed(
            -across * per_l2,
            form.lever2 * ratio2,
            form.per_mass * per_l2 * leg2.u_y,
            -form.per_mass * per_l2 * leg2.u_x,
        ),
    )
    t1 = _turn(leg1, per_l1, ratio1, response.ddq11, response.ax, response.ay)
    t2 = _turn(leg2, per_l2, ratio2, response.ddq21, response.ax, response.ay)
    t1 -= drift * robot.leg1.proximal * per_l1 * leg1.sin_q2 * leg1.dq1 * leg1.dq1
    t2 -= drift * robot.leg2.proximal * per_l2 * leg2.sin_q2 * leg2.dq1 * leg2.dq1
    zz1, zz2 = robot.leg1.residual, robot.leg2.residual
    e11 = 1.0 - zz1 * _turn(leg1, per_l1, ratio1, response1.ddq11, response1.ax, response1.ay)
    e12 = -zz1 * _turn(leg1, per_l1, ratio1, response2.ddq11, response2.ax, response2.ay)
    e21 = -zz2 * _turn(leg2, per_l2, ratio2, response1.ddq21, response1.ax, response1.ay)
    e22 = 1.0 - zz2 * _turn(leg2, per_l2, ratio2, response2.ddq21, response2.ax, response2.ay)
    determinant = e11 * e22 - e12 * e21
    m1 = (e22 * zz1 * t1 - e12 * zz2 * t2) / determinant
    m2 = (e11 * zz2 * t2 - e21 * zz1 * t1) / determinant
    return DynamicResponse(
        ddq11=response.ddq11 + m1 * response1.ddq11 + m2 * response2.ddq11,
        ddq21=response.ddq21 + m1 * response1.ddq21 + m2 * response2.ddq21,
        ax=response.ax + m1 * response1.ax + m2 * response2.ax,
        ay=response.ay + m1 * response1.ay + m2 * response2.ay,
        lambda1=response.lambda1 + m1 * response1.lambda1 + m2 * response2.lambda1,
        lambda2=response.lambda2 + m1 * response1.lambda2 + m2 * response2.lambda2,
    )


def _turn(leg: Leg, per_length: float, ratio: float, ddq1: float, ax: float, ay: float) -> float:
    """Return d2 theta_i / dt2 without its part that is quadratic in the rates."""
    return per_length * (leg.u_x * ay - leg.u_y * ax) - ratio * ddq1
