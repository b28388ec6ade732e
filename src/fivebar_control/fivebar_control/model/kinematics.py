# SPDX-License-Identifier: Apache-2.0
"""First and second order kinematics: A xdot = B qdot and A xddot + c = B qddot.

A has the rows u_1, u_2 and B is diag(l_i1 sin q_i2). The pair is consistent with 1.30 and 1.31; equations 1.1, 3.5 and
3.29 print one of the two with the opposite sign.
"""

from __future__ import annotations

import math

from fivebar_control.model.geometry import direct_geometry, elbow_position, inverse_geometry, wrap
from fivebar_control.model.state import Joints, Leg, State, WorkingMode
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
    return leg_with_rates(leg, still, dq1, dtheta)


def leg_with_rates(parameters: LegParameters, leg: Leg, dq1: float, dtheta: float) -> Leg:
    """Return leg i in the same posture with other rates (rad/s) of q_i1 and theta_i."""
    return Leg(
        q1=leg.q1,
        q2=leg.q2,
        dq1=dq1,
        dtheta=dtheta,
        r_x=leg.r_x,
        r_y=leg.r_y,
        u_x=leg.u_x,
        u_y=leg.u_y,
        cos_q2=leg.cos_q2,
        sin_q2=leg.sin_q2,
        b=leg.b,
        c=parameters.distal * dtheta * dtheta + parameters.proximal * leg.cos_q2 * dq1 * dq1,
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

    The platform is the mean of both legs' forward kinematics; every conversion of `joint_states` goes through here.
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


def state_from_platform(robot: FiveBar, mode: WorkingMode, x: float, y: float, vx: float, vy: float) -> State:
    """Return the state from the platform's position (m) and velocity (m/s) in a working mode.

    Regular on the Type 2 locus. Out of reach all joint quantities are NaN.
    """
    q = inverse_geometry(robot, mode, x, y)
    leg1 = leg_from_platform(robot.leg1, q.q11, q.q12, vx, vy)
    leg2 = leg_from_platform(robot.leg2, q.q21, q.q22, vx, vy)
    return State(leg1, leg2, x, y, vx, vy)


def state_from_motors(robot: FiveBar, assembly: int, q11: float, q21: float, dq11: float, dq21: float) -> State:
    """Return the state from both motors' angles (rad) and rates (rad/s) in an assembly mode, the sign of det A.

    xdot = A^-1 B qdot, and theta_i from the platform as seen from the elbow: regular at Type 1. On the Type 2 locus and
    where the distal links cannot meet, all but the motors' own angles is NaN.
    """
    x, y = direct_geometry(robot, assembly, q11, q21)
    still1, still2 = _leg_to_point(robot.leg1, q11, x, y), _leg_to_point(robot.leg2, q21, x, y)
    determinant = still1.u_x * still2.u_y - still1.u_y * still2.u_x
    if math.isnan(x) or determinant == 0.0:
        open1 = leg_from_joints(robot.leg1, q11, NAN, NAN, NAN)
        open2 = leg_from_joints(robot.leg2, q21, NAN, NAN, NAN)
        return State(open1, open2, NAN, NAN, NAN, NAN)
    right1, right2 = still1.b * dq11, still2.b * dq21
    vx = (right1 * still2.u_y - right2 * still1.u_y) / determinant
    vy = (right2 * still1.u_x - right1 * still2.u_x) / determinant
    leg1 = leg_with_rates(robot.leg1, still1, dq11, _distal_rate(robot.leg1, still1, dq11, vx, vy))
    leg2 = leg_with_rates(robot.leg2, still2, dq21, _distal_rate(robot.leg2, still2, dq21, vx, vy))
    return State(leg1, leg2, x, y, vx, vy)


def _leg_to_point(leg: LegParameters, q1: float, x: float, y: float) -> Leg:
    """Return leg i at rest for its motor angle (rad) and the platform's position (m)."""
    elbow_x, elbow_y = elbow_position(leg, q1)
    return leg_from_joints(leg, q1, wrap(math.atan2(y - elbow_y, x - elbow_x) - q1), 0.0, 0.0)


def _distal_rate(parameters: LegParameters, leg: Leg, dq1: float, vx: float, vy: float) -> float:
    """Return dtheta_i (rad/s) from the velocity of the platform relative to the elbow, across the distal link."""
    l_1 = parameters.proximal
    relative_x, relative_y = vx + l_1 * dq1 * leg.r_y, vy - l_1 * dq1 * leg.r_x
    return (leg.u_x * relative_y - leg.u_y * relative_x) / parameters.distal


def joints_of(state: State) -> Joints:
    """Return the joint angles and rates of a state."""
    leg1, leg2 = state.leg1, state.leg2
    return Joints(
        q11=leg1.q1,
        q12=leg1.q2,
        q21=leg2.q1,
        q22=leg2.q2,
        dq11=leg1.dq1,
        dq12=leg1.dtheta - leg1.dq1,
        dq21=leg2.dq1,
        dq22=leg2.dtheta - leg2.dq1,
    )


def det_a(state: State) -> float:
    """Return det A = u_1 x u_2, whose sign is the assembly mode and whose zero is Type 2."""
    return state.leg1.u_x * state.leg2.u_y - state.leg1.u_y * state.leg2.u_x


def assembly_mode(state: State) -> int:
    """Return the assembly mode, the sign of det A; -1 on the Type 2 locus and for an undefined state."""
    return 1 if det_a(state) > 0.0 else -1


def elbow_side(q2_sine: float) -> int:
    """Return the working mode of a leg from sin q_i2, +1 for an elbow counter-clockwise; at Type 1 +1."""
    return -1 if q2_sine > 0.0 else 1


def working_mode(state: State) -> WorkingMode:
    """Return the working mode: for each leg +1 where the elbow is counter-clockwise of the line to the platform."""
    return elbow_side(state.leg1.sin_q2), elbow_side(state.leg2.sin_q2)


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
