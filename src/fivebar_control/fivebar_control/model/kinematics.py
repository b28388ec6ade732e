"""First and second order kinematics: A xdot = B qdot and A xddot + c = B qddot.

A has the rows u_1, u_2 and B is diag(l_i1 sin q_i2). The pair is consistent with 1.30 and 1.31; equations 1.1, 3.5 and
3.29 print one of the two with the opposite sign.
"""

from __future__ import annotations

import math

from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.state import Leg, State
from fivebar_description.parameters import FiveBar, LegParameters

NAN = math.nan


def leg_from_joints(leg: LegParameters, q1: float, q2: float, dq1: float, dq2: float) -> Leg:
    """Return leg i from its two joint angles (rad) and rates (rad/s)."""
    theta, dtheta = q1 + q2, dq1 + dq2
    cos_q2, sin_q2 = math.cos(q2), math.sin(q2)
    return Leg(
        q1=q1,
        q2=q2,
        dq1=dq1,
        dtheta=dtheta,
        r_x=math.cos(q1),
        r_y=math.sin(q1),
        u_x=math.cos(theta),
        u_y=math.sin(theta),
        cos_q2=cos_q2,
        sin_q2=sin_q2,
        b=leg.proximal * sin_q2,
        c=leg.distal * dtheta * dtheta + leg.proximal * cos_q2 * dq1 * dq1,
    )


def leg_from_platform(leg: LegParameters, q1: float, q2: float, vx: float, vy: float) -> Leg:
    """Return leg i from its joint angles and the platform velocity (m/s).

    The rates follow from u_i . xdot = l_i1 sin(q_i2) dq_i1 and r_i . xdot = -l_i2 sin(q_i2) dtheta_i; they are NaN at
    Type 1, where sin q_i2 = 0.
    """
    still = leg_from_joints(leg, q1, q2, 0.0, 0.0)
    dq1 = dtheta = NAN
    if still.b != 0.0:
        dq1 = (still.u_x * vx + still.u_y * vy) / still.b
        dtheta = -(still.r_x * vx + still.r_y * vy) / (leg.distal * still.sin_q2)
    return Leg(
        q1=q1,
        q2=q2,
        dq1=dq1,
        dtheta=dtheta,
        r_x=still.r_x,
        r_y=still.r_y,
        u_x=still.u_x,
        u_y=still.u_y,
        cos_q2=still.cos_q2,
        sin_q2=still.sin_q2,
        b=still.b,
        c=leg.distal * dtheta * dtheta + leg.proximal * still.cos_q2 * dq1 * dq1,
    )


def state_from_joints(
    robot: FiveBar,
    q11: float,
    q12: float,
    q21: float,
    q22: float,
    dq11: float,
    dq12: float,
    dq21: float,
    dq22: float,
) -> State:
    """Return the state from the four joint angles (rad) and rates (rad/s).

    This is the one way from `joint_states` to the platform: the mean of both legs' forward kinematics.
    """
    leg1 = leg_from_joints(robot.leg1, q11, q12, dq11, dq12)
    leg2 = leg_from_joints(robot.leg2, q21, q22, dq21, dq22)
    x1, y1, vx1, vy1 = _tip(robot.leg1, leg1)
    x2, y2, vx2, vy2 = _tip(robot.leg2, leg2)
    return State(leg1, leg2, 0.5 * (x1 + x2), 0.5 * (y1 + y2), 0.5 * (vx1 + vx2), 0.5 * (vy1 + vy2))


def _tip(parameters: LegParameters, leg: Leg) -> tuple[float, float, float, float]:
    l_1, l_2 = parameters.proximal, parameters.distal
    return (
        parameters.base_x + l_1 * leg.r_x + l_2 * leg.u_x,
        l_1 * leg.r_y + l_2 * leg.u_y,
        -l_1 * leg.dq1 * leg.r_y - l_2 * leg.dtheta * leg.u_y,
        l_1 * leg.dq1 * leg.r_x + l_2 * leg.dtheta * leg.u_x,
    )


def state_from_platform(robot: FiveBar, mode1: int, mode2: int, x: float, y: float, vx: float, vy: float) -> State:
    """Return the state from the platform's position (m) and velocity (m/s) in a working mode.

    Regular on the Type 2 locus. Out of reach all joint figures are NaN.
    """
    q = inverse_geometry(robot, mode1, mode2, x, y)
    leg1 = leg_from_platform(robot.leg1, q.q11, q.q12, vx, vy)
    leg2 = leg_from_platform(robot.leg2, q.q21, q.q22, vx, vy)
    return State(leg1, leg2, x, y, vx, vy)


def det_a(state: State) -> float:
    """Return det A = u_1 x u_2, whose sign is the assembly mode and whose zero is Type 2."""
    return state.leg1.u_x * state.leg2.u_y - state.leg1.u_y * state.leg2.u_x


def joint_acceleration(leg: Leg, ax: float, ay: float) -> float:
    """Return qddot_i1 (rad/s^2) for a platform acceleration (m/s^2): row i of B^-1 (A xddot + c); NaN at Type 1."""
    if leg.b == 0.0:
        return NAN
    return (leg.u_x * ax + leg.u_y * ay + leg.c) / leg.b


def distal_acceleration(parameters: LegParameters, leg: Leg, ax: float, ay: float) -> float:
    """Return d2 theta_i / dt2 (rad/s^2) for a platform acceleration (m/s^2); NaN at Type 1.

    From r_i . xddot = -l_i1 dq_i1^2 - l_i2 (sin(q_i2) ddtheta_i + cos(q_i2) dtheta_i^2).
    """
    if leg.sin_q2 == 0.0:
        return NAN
    along = leg.r_x * ax + leg.r_y * ay + parameters.proximal * leg.dq1 * leg.dq1
    return -(along / parameters.distal + leg.cos_q2 * leg.dtheta * leg.dtheta) / leg.sin_q2


def distal_acceleration_by_motor(parameters: LegParameters, leg: Leg, ddq1: float, ax: float, ay: float) -> float:
    """Return d2 theta_i / dt2 (rad/s^2) for accelerations of motor (rad/s^2) and platform (m/s^2), at Type 1 too.

    Across the distal link: l_i2 ddtheta_i = (-u_y, u_x) . xddot - l_i1 (cos(q_i2) ddq_i1 + sin(q_i2) dq_i1^2).
    """
    elbow = parameters.proximal * (leg.cos_q2 * ddq1 + leg.sin_q2 * leg.dq1 * leg.dq1)
    return 1.0 / parameters.distal * (leg.u_x * ay - leg.u_y * ax - elbow)


def platform_acceleration(state: State, ddq11: float, ddq21: float) -> tuple[float, float]:
    """Return xddot = A^-1 (B qddot - c) in m/s^2; NaN on the Type 2 locus."""
    determinant = det_a(state)
    if determinant == 0.0:
        return NAN, NAN
    right1 = state.leg1.b * ddq11 - state.leg1.c
    right2 = state.leg2.b * ddq21 - state.leg2.c
    return (
        (right1 * state.leg2.u_y - right2 * state.leg1.u_y) / determinant,
        (right2 * state.leg1.u_x - right1 * state.leg2.u_x) / determinant,
    )
