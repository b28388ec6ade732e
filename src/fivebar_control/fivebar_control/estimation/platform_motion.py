# SPDX-License-Identifier: Apache-2.0
"""The direct dynamics in platform coordinates without angles, and its derivatives: the process model of the filter.

M(x) xddot + h = N^T (tau + d - f), N = B^-1 A, as in `fivebar_control.model.dynamics`, with the forces that act all the
time in h and f, but with every unit vector taken from the platform's position by algebra (one square root per leg),
because the filter evaluates it eight times per sample. Regular on the Type 2 locus, NaN at Type 1 and out of reach.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.dynamics import (
    DistalRow,
    PlatformModel,
    platform_model_of_rows,
    platform_motion,
    with_residual_rows,
)
from fivebar_control.model.state import WorkingMode
from fivebar_description.parameters import (
    FiveBar,
    LegParameters,
    friction_slope,
    friction_torque,
    has_residual,
    lost_torque,
    weight_torque,
)

NAN = math.nan


class LegMotion(NamedTuple):
    """Leg i as the platform's position and velocity have it.

    Attributes:
        r_x, r_y: unit vector along the proximal link.
        u_x, u_y: unit vector along the distal link.
        cos_q2, sin_q2: of the passive relative angle.
        b: l_i1 sin q_i2 (m).
        n_x, n_y: d q_i1 / d (x, y) = u_i / b (rad/m), row i of N.
        w_x, w_y: d theta_i / d (x, y) = -r_i / (l_i2 sin q_i2) (rad/m).
        dq1: motor speed (rad/s).
        dtheta: rate of the distal link (rad/s).
        drift: c_i / b (rad/s^2), the motor acceleration for xddot = 0.
    """

    r_x: float
    r_y: float
    u_x: float
    u_y: float
    cos_q2: float
    sin_q2: float
    b: float
    n_x: float
    n_y: float
    w_x: float
    w_y: float
    dq1: float
    dtheta: float
    drift: float


UNREACHABLE = LegMotion(*(NAN,) * 14)


def leg_motion(leg: LegParameters, mode: int, x: float, y: float, vx: float, vy: float) -> LegMotion:
    """Return leg i for the platform at (x, y) m with velocity (vx, vy) m/s in a working mode."""
    l_1, l_2 = leg.proximal, leg.distal
    dx = x - leg.base_x
    squared = dx * dx + y * y
    cos_q2 = (squared - l_1 * l_1 - l_2 * l_2) / (2.0 * l_1 * l_2)
    sine_squared = (1.0 - cos_q2) * (1.0 + cos_q2)
    if not sine_squared > 0.0:
        return UNREACHABLE
    sin_q2 = -mode * math.sqrt(sine_squared)
    # P - O = (along + i across) r as complex numbers
    along, across = (l_1 + l_2 * cos_q2) / squared, l_2 * sin_q2 / squared
    r_x, r_y = along * dx + across * y, along * y - across * dx
    u_x, u_y = (dx - l_1 * r_x) / l_2, (y - l_1 * r_y) / l_2
    b = l_1 * sin_q2
    n_x, n_y = u_x / b, u_y / b
    lever = -1.0 / (l_2 * sin_q2)
    w_x, w_y = lever * r_x, lever * r_y
    dq1 = n_x * vx + n_y * vy
    dtheta = w_x * vx + w_y * vy
    drift = (l_2 * dtheta * dtheta + l_1 * cos_q2 * dq1 * dq1) / b
    return LegMotion(r_x, r_y, u_x, u_y, cos_q2, sin_q2, b, n_x, n_y, w_x, w_y, dq1, dtheta, drift)


def leg_at_rest(leg: LegParameters, mode: int, x: float, y: float) -> LegMotion:
    """Return leg i for a platform that rests at (x, y) m: its posture is all that counts."""
    return leg_motion(leg, mode, x, y, 0.0, 0.0)


class Applied(NamedTuple):
    """The motors' torques (Nm) and a force on the platform (N)."""

    tau1: float
    tau2: float
    fx: float
    fy: float


def platform_acceleration(
    robot: FiveBar,
    mode: WorkingMode,
    x: float,
    y: float,
    vx: float,
    vy: float,
    applied: Applied,
) -> tuple[float, float]:
    """Return xddot (m/s^2) of a moving platform (m, m/s), including modelled friction at the motor speeds."""
    parameters1, parameters2 = robot.leg1, robot.leg2
    leg1 = leg_motion(parameters1, mode[0], x, y, vx, vy)
    leg2 = leg_motion(parameters2, mode[1], x, y, vx, vy)
    model = _model(robot, leg1, leg2)
    net1, net2 = applied.tau1 - _lost(robot, parameters1, leg1), applied.tau2 - _lost(robot, parameters2, leg2)
    return platform_motion(model, net1, net2, applied.fx, applied.fy)


def _lost(robot: FiveBar, leg: LegParameters, moving: LegMotion) -> float:
    """Return what a motor loses (Nm) to friction, known cogging and the weight of its leg."""
    if leg.periods_1 > 0.0:
        return lost_torque(robot, leg, math.atan2(moving.r_y, moving.r_x), moving.dq1)
    friction = friction_torque(leg, moving.dq1)
    return friction if leg.moment == 0.0 else friction + weight_torque(robot, leg, moving.r_x, moving.r_y)


def _model(robot: FiveBar, leg1: LegMotion, leg2: LegMotion) -> PlatformModel:
    model = platform_model_of_rows(robot, leg1.n_x, leg1.n_y, leg1.drift, leg2.n_x, leg2.n_y, leg2.drift)
    if has_residual(robot):
        row1 = DistalRow(leg1.w_x, leg1.w_y, _distal_drift(robot.leg1, leg1))
        row2 = DistalRow(leg2.w_x, leg2.w_y, _distal_drift(robot.leg2, leg2))
        return with_residual_rows(robot, model, row1, row2)
    return model


def _distal_drift(leg: LegParameters, moving: LegMotion) -> float:
    """Return d2 theta_i / dt2 (rad/s^2) for xddot = 0."""
    ratio = leg.proximal / leg.distal
    return -(ratio * moving.dq1 * moving.dq1 + moving.cos_q2 * moving.dtheta * moving.dtheta) / moving.sin_q2


class Derivatives(NamedTuple):
    """Derivatives of xddot by position (1/s^2), velocity (1/s), motor torques (m/(s^2 Nm)) and force (1/kg).

    Each is 2x2, row by row: xx is d ax / d x, xy is d ax / d y, yx is d ay / d x; of the torques x1 is d ax / d tau1.
    That by the force on the platform, M^-1, is symmetric.
    """

    p_xx: float
    p_xy: float
    p_yx: float
    p_yy: float
    v_xx: float
    v_xy: float
    v_yx: float
    v_yy: float
    t_x1: float
    t_x2: float
    t_y1: float
    t_y2: float
    f_xx: float
    f_xy: float
    f_yy: float


def acceleration_derivatives(
    robot: FiveBar,
    mode: WorkingMode,
    x: float,
    y: float,
    vx: float,
    vy: float,
    applied: Applied,
) -> Derivatives:
    """Return the derivatives of `platform_acceleration`, analytically.

    From m a = F + sum_i n_i p_i with p_i = tau_i - f_i - zz_i (n_i . a + drift_i), differentiated along a direction e:
    M da = sum_i [ dn_i p_i - n_i (f_i' d(dq_i) + zz_i (dn_i . a + d(drift_i))) ]. A residual inertia zz_i2 adds
    w_i s_i to the sum, s_i = -zz_i2 (w_i . a + e_i), e_i the drift of dtheta_i, and likewise dw_i s_i + w_i ds_i.
    The slope of known cogging over the angle is left out: the covariance takes it for a part of the disturbance.
    """
    leg1 = leg_motion(robot.leg1, mode[0], x, y, vx, vy)
    leg2 = leg_motion(robot.leg2, mode[1], x, y, vx, vy)
    model = _model(robot, leg1, leg2)
    net1, net2 = applied.tau1 - _lost(robot, robot.leg1, leg1), applied.tau2 - _lost(robot, robot.leg2, leg2)
    ax, ay = platform_motion(model, net1, net2, applied.fx, applied.fy)
    px_x = px_y = py_x = py_y = vx_x = vx_y = vy_x = vy_y = 0.0
    for leg, moving, net in ((robot.leg1, leg1, net1), (robot.leg2, leg2, net2)):
        n_x, n_y, zz = moving.n_x, moving.n_y, leg.inertia
        slope = friction_slope(leg, moving.dq1)
        p = net - zz * (n_x * ax + n_y * ay + moving.drift)
        # by the position: the force on the platform changes by dn p - n (f' d(dq) + zz (dn . a + d drift))
        by_x = _changes(leg, moving, vx, vy, 1.0, 0.0)
        by_y = _changes(leg, moving, vx, vy, 0.0, 1.0)
        x_load = _load_change(leg, moving, by_x, ax, ay, slope)
        y_load = _load_change(leg, moving, by_y, ax, ay, slope)
        if leg.moment != 0.0:
            # the weight of the leg, over the motor's angle
            change = leg.moment * (robot.gravity_x * moving.r_x + robot.gravity_y * moving.r_y)
            x_load, y_load = x_load + change * n_x, y_load + change * n_y
        px_x += by_x.dn_x * p - n_x * x_load
        px_y += by_x.dn_y * p - n_y * x_load
        py_x += by_y.dn_x * p - n_x * y_load
        py_y += by_y.dn_y * p - n_y * y_load
        # by the velocity: only friction and drift change
        turn = 2.0 * leg.distal * moving.dtheta / moving.b
        swing = 2.0 * leg.proximal * moving.cos_q2 * moving.dq1 / moving.b
        load_x = slope * n_x + zz * (turn * moving.w_x + swing * n_x)
        load_y = slope * n_y + zz * (turn * moving.w_y + swing * n_y)
        vx_x -= n_x * load_x
        vx_y -= n_y * load_x
        vy_x -= n_x * load_y
        vy_y -= n_y * load_y
        if leg.residual != 0.0:
            w_x, w_y = moving.w_x, moving.w_y
            s = -leg.residual * (w_x * ax + w_y * ay + _distal_drift(leg, moving))
            x_load = _moment_change(leg, moving, by_x, ax, ay)
            y_load = _moment_change(leg, moving, by_y, ax, ay)
            px_x += by_x.dw_x * s - w_x * x_load
            px_y += by_x.dw_y * s - w_y * x_load
            py_x += by_y.dw_x * s - w_x * y_load
            py_y += by_y.dw_y * s - w_y * y_load
            lever = -2.0 * leg.residual / moving.sin_q2
            swing, turn = lever * leg.proximal / leg.distal * moving.dq1, lever * moving.cos_q2 * moving.dtheta
            load_x, load_y = swing * n_x + turn * w_x, swing * n_y + turn * w_y
            vx_x -= w_x * load_x
            vx_y -= w_y * load_x
            vy_x -= w_x * load_y
            vy_y -= w_y * load_y
    determinant = model.m_xx * model.m_yy - model.m_xy * model.m_xy
    i_xx, i_xy, i_yy = model.m_yy / determinant, -model.m_xy / determinant, model.m_xx / determinant
    return Derivatives(
        p_xx=i_xx * px_x + i_xy * px_y,
        p_xy=i_xx * py_x + i_xy * py_y,
        p_yx=i_xy * px_x + i_yy * px_y,
        p_yy=i_xy * py_x + i_yy * py_y,
        v_xx=i_xx * vx_x + i_xy * vx_y,
        v_xy=i_xx * vy_x + i_xy * vy_y,
        v_yx=i_xy * vx_x + i_yy * vx_y,
        v_yy=i_xy * vy_x + i_yy * vy_y,
        t_x1=i_xx * leg1.n_x + i_xy * leg1.n_y,
        t_x2=i_xx * leg2.n_x + i_xy * leg2.n_y,
        t_y1=i_xy * leg1.n_x + i_yy * leg1.n_y,
        t_y2=i_xy * leg2.n_x + i_yy * leg2.n_y,
        f_xx=i_xx,
        f_xy=i_xy,
        f_yy=i_yy,
    )


class RowChanges(NamedTuple):
    """The derivatives of a leg's rows n and w as the platform moves along a direction e.

    q_i1 and theta_i turn by n . e and w . e; every other change follows from these two.

    Attributes:
        d_q2: turn of q_i2 (rad/m).
        stretch: d_q2 / tan q_i2 (1/m).
        dn_x, dn_y, dw_x, dw_y: of the rows (1/m^2).
        d_speed, d_turn: of dq_i1 and dtheta_i (rad/s per m).
    """

    d_q2: float
    stretch: float
    dn_x: float
    dn_y: float
    dw_x: float
    dw_y: float
    d_speed: float
    d_turn: float


def _changes(leg: LegParameters, moving: LegMotion, vx: float, vy: float, e_x: float, e_y: float) -> RowChanges:
    d_q1 = moving.n_x * e_x + moving.n_y * e_y
    d_theta = moving.w_x * e_x + moving.w_y * e_y
    d_q2 = d_theta - d_q1
    stretch = moving.cos_q2 * d_q2 / moving.sin_q2
    dn_x = -moving.u_y * d_theta / moving.b - moving.n_x * stretch
    dn_y = moving.u_x * d_theta / moving.b - moving.n_y * stretch
    lever = -1.0 / (leg.distal * moving.sin_q2)
    dw_x = -moving.r_y * d_q1 * lever - moving.w_x * stretch
    dw_y = moving.r_x * d_q1 * lever - moving.w_y * stretch
    return RowChanges(d_q2, stretch, dn_x, dn_y, dw_x, dw_y, dn_x * vx + dn_y * vy, dw_x * vx + dw_y * vy)


def _load_change(
    leg: LegParameters, moving: LegMotion, change: RowChanges, ax: float, ay: float, slope: float
) -> float:
    """Return the change of the motor's load (Nm/m)."""
    d_c = (
        2.0 * leg.distal * moving.dtheta * change.d_turn
        - leg.proximal * moving.sin_q2 * change.d_q2 * moving.dq1 * moving.dq1
        + 2.0 * leg.proximal * moving.cos_q2 * moving.dq1 * change.d_speed
    )
    d_drift = d_c / moving.b - moving.drift * change.stretch
    return slope * change.d_speed + leg.inertia * (change.dn_x * ax + change.dn_y * ay + d_drift)


def _moment_change(leg: LegParameters, moving: LegMotion, change: RowChanges, ax: float, ay: float) -> float:
    """Return the change of the distal link's moment (Nm/m)."""
    d_c = (
        2.0 * leg.proximal / leg.distal * moving.dq1 * change.d_speed
        - moving.sin_q2 * change.d_q2 * moving.dtheta * moving.dtheta
        + 2.0 * moving.cos_q2 * moving.dtheta * change.d_turn
    )
    d_drift = -d_c / moving.sin_q2 - _distal_drift(leg, moving) * change.stretch
    return leg.residual * (change.dw_x * ax + change.dw_y * ay + d_drift)


def turn_change(leg: LegParameters, moving: LegMotion, vx: float, vy: float, d_q1: float, d_theta: float) -> float:
    """Return the change of the distal link's rate w . xdot (rad/s) as both links turn by d_q1 and d_theta (rad)."""
    stretch = moving.cos_q2 * (d_theta - d_q1) / moving.sin_q2
    lever = -1.0 / (leg.distal * moving.sin_q2)
    return (-moving.r_y * d_q1 * lever - moving.w_x * stretch) * vx + (
        moving.r_x * d_q1 * lever - moving.w_y * stretch
    ) * vy
