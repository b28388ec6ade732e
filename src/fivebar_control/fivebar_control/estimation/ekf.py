# SPDX-License-Identifier: Apache-2.0
"""An extended Kalman filter of the platform's motion from motor encoders, a gyroscope and the applied torques.

This module has its states, settings and prediction, `fivebar_control.estimation.measurements` its measurement updates.

The state is (x, y, vx, vy, d1, d2, bias, clock, passive, fx, fy): the platform's position and velocity, one disturbance
torque per motor, the gyroscope's bias and the offset of its clock, each a random walk, the zero of an encoder on a
passive joint, and a force on the platform. It is in platform coordinates because position and working mode determine
the joint angles on both sides of the Type 2 locus: the measurement, the inverse geometry of the two motor angles, is
single-valued there, and so the filter follows a change of assembly mode without a switch, as long as the estimated
velocity shows that the robot crossed. A gyroscope on the distal link of leg 2 shows it directly: its rate
w_2 . xdot is regular on the locus and differs between the two assembly modes that share the motors' angles and speeds.
With an encoder on a passive joint, that joint and the motor of its leg determine the platform, on the locus as well.

Constant errors of the geometry, the motor encoders' zeros and the gyroscope's sensitivity are estimated with them, from
the tolerances within which they are declared, where there is a sensor beside the motors' encoders
(`fivebar_control.estimation.covariance`).
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_control.estimation.covariance import (
    BASE1,
    BASE2,
    BIAS,
    CLOCK_ERROR,
    D1,
    D2,
    ERRORS,
    FX,
    FY,
    L11,
    L12,
    L21,
    L22,
    PASSIVE,
    SCALE,
    SIZE,
    VX,
    VY,
    ZERO1,
    ZERO2,
    Matrix,
    ProcessNoise,
    Vector,
    X,
    Y,
    process_noise,
    propagated,
    with_torque_noise,
)
from fivebar_control.estimation.platform_motion import (
    Applied,
    acceleration_derivatives,
    platform_acceleration,
)
from fivebar_control.estimation.settings import EkfSettings
from fivebar_control.model.state import WorkingMode
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import EXACT, UNIFORM, Tolerances

STIFFNESS_LIMIT = 2.0
"""Largest product of the friction's rate and an integration step; classical Runge-Kutta is stable up to 2.78."""


class ConstantErrors(NamedTuple):
    """Constant errors of the robot and its sensors, in the order of the covariance: estimates or standard deviations.

    Attributes:
        zero1, zero2: of the motor encoders' zeros (rad).
        l_11, l_12, l_21, l_22: of the links' lengths, actual minus nominal (m).
        base1, base2: of the base joints' x, actual minus nominal (m).
        scale: of the gyroscope's relative sensitivity.
    """

    zero1: float
    zero2: float
    l_11: float
    l_12: float
    l_21: float
    l_22: float
    base1: float
    base2: float
    scale: float


NO_ERRORS = ConstantErrors(0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Estimate(NamedTuple):
    """The estimated states.

    Attributes:
        x, y, vx, vy: platform position (m) and velocity (m/s).
        d1, d2: disturbance torque of each motor (Nm).
        bias: of the gyroscope (rad/s).
        clock: by how much the stamps of the gyroscope's clock are late (s), beyond what is known of it.
        passive: reading of the passive joint's encoder where the angle is 0 (rad), beyond what is known of it.
        fx, fy: force on the platform (N).
        errors: of robot and sensors, as far as this motion has shown them.
    """

    x: float
    y: float
    vx: float
    vy: float
    d1: float
    d2: float
    bias: float = 0.0
    clock: float = 0.0
    passive: float = 0.0
    fx: float = 0.0
    fy: float = 0.0
    errors: ConstantErrors = NO_ERRORS


def as_vector(estimate: Estimate) -> Vector:
    """Return an estimate in the order of the covariance, [SIZE]."""
    vector = np.empty(SIZE)
    vector[X], vector[Y], vector[VX], vector[VY] = estimate.x, estimate.y, estimate.vx, estimate.vy
    vector[D1], vector[D2], vector[BIAS] = estimate.d1, estimate.d2, estimate.bias
    for index, error in enumerate(estimate.errors):
        vector[ERRORS + index] = error
    vector[CLOCK_ERROR], vector[PASSIVE] = estimate.clock, estimate.passive
    vector[FX], vector[FY] = estimate.fx, estimate.fy
    return vector


def from_vector(vector: Vector) -> Estimate:
    """Return the estimate with the entries of a vector, [SIZE], as numbers of Python: those of numpy are slow."""
    v = vector
    return Estimate(
        x=float(v[X]),
        y=float(v[Y]),
        vx=float(v[VX]),
        vy=float(v[VY]),
        d1=float(v[D1]),
        d2=float(v[D2]),
        bias=float(v[BIAS]),
        clock=float(v[CLOCK_ERROR]),
        passive=float(v[PASSIVE]),
        fx=float(v[FX]),
        fy=float(v[FY]),
        errors=ConstantErrors(
            zero1=float(v[ZERO1]),
            zero2=float(v[ZERO2]),
            l_11=float(v[L11]),
            l_12=float(v[L12]),
            l_21=float(v[L21]),
            l_22=float(v[L22]),
            base1=float(v[BASE1]),
            base2=float(v[BASE2]),
            scale=float(v[SCALE]),
        ),
    )


class Belief(NamedTuple):
    """An estimate and its covariance, float64[SIZE, SIZE]."""

    estimate: Estimate
    covariance: Matrix


def error_deviations(tolerances: Tolerances) -> ConstantErrors:
    """Return the standard deviations of errors that are uniform within their tolerances."""
    length, base, zero = (t / UNIFORM for t in (tolerances.length, tolerances.base, tolerances.zero))
    scale = tolerances.gyro_scale / UNIFORM
    return ConstantErrors(zero, zero, length, length, length, length, base, base, scale)


class FilterModel(NamedTuple):
    """Constants of the filter's steps.

    Attributes:
        robot, mode: the nominal robot and its working mode.
        period: sampling period (s).
        step, steps: of the integration, over half a period (s).
        noise: process noise of one period.
        disturbance_initial: standard deviation of each disturbance at the start (Nm).
        force_deviation: of each component of the force on the platform at the start (N).
        gyro_noise, gyro_bias: standard deviations of a gyroscope reading and of its bias at the start (rad/s).
        gyro_clock: standard deviation of the offset of its clock at the start (s).
        passive_zero: standard deviation of the zero of the passive joint's encoder (rad).
        errors: standard deviations of the constant errors at the start.
        estimates_errors: whether they are estimated; else they are considered only (Schmidt-Kalman filter).
    """

    robot: FiveBar
    mode: WorkingMode
    period: float
    step: float
    steps: int
    noise: ProcessNoise
    disturbance_initial: float
    force_deviation: float
    gyro_noise: float
    gyro_bias: float
    gyro_clock: float
    passive_zero: float
    errors: ConstantErrors
    estimates_errors: bool


def filter_model(
    robot: FiveBar,
    mode: WorkingMode,
    rate_hz: int,
    settings: EkfSettings,
    tolerances: Tolerances = EXACT,
    estimates_errors: bool = True,
) -> FilterModel:
    """Return the filter's model of a robot; its step is one that the slope of the friction allows."""
    period = 1.0 / rate_hz
    stiffness = max(leg.coulomb / (leg.width * leg.inertia) for leg in (robot.leg1, robot.leg2))
    steps = max(1, math.ceil(0.5 * period * stiffness / STIFFNESS_LIMIT))
    clock_rate = settings.gyro_clock_rate if settings.gyro_clock > 0.0 else 0.0
    noise = process_noise(
        settings.acceleration_noise,
        settings.disturbance_rate,
        settings.gyro_bias_rate,
        clock_rate,
        period,
        settings.force_deviation,
        settings.force_time,
    )
    return FilterModel(
        robot=robot,
        mode=mode,
        period=period,
        step=0.5 * period / steps,
        steps=steps,
        noise=noise,
        disturbance_initial=settings.disturbance_initial,
        force_deviation=settings.force_deviation,
        gyro_noise=settings.gyro_noise,
        gyro_bias=settings.gyro_bias,
        gyro_clock=settings.gyro_clock,
        passive_zero=tolerances.passive_zero / UNIFORM,
        errors=error_deviations(tolerances),
        estimates_errors=estimates_errors,
    )


def predicted(model: FilterModel, belief: Belief, tau1: float, tau2: float) -> Belief:
    """Return the belief one period later, under torques (Nm) that were applied throughout it."""
    middle = _half(model, belief.estimate, tau1, tau2)
    later = _half(model, middle, tau1, tau2)
    return Belief(later, propagated(belief.covariance, transition(model, middle, tau1, tau2), model.noise))


def guessed(model: FilterModel, belief: Belief, tau1: float, tau2: float, doubt1: float, doubt2: float) -> Belief:
    """Return the belief one period later, under torques (Nm) that were not measured.

    `doubt1` and `doubt2` are their standard deviations (Nm).
    """
    middle = _half(model, belief.estimate, tau1, tau2)
    rows = transition(model, middle, tau1, tau2)
    covariance = with_torque_noise(
        propagated(belief.covariance, rows, model.noise), rows, doubt1 * doubt1, doubt2 * doubt2
    )
    return Belief(_half(model, middle, tau1, tau2), covariance)


def advanced(model: FilterModel, estimate: Estimate, tau1: float, tau2: float) -> Estimate:
    """Return the estimate one period later, without its covariance."""
    return _half(model, _half(model, estimate, tau1, tau2), tau1, tau2)


def _half(model: FilterModel, estimate: Estimate, tau1: float, tau2: float) -> Estimate:
    """Integrate over half a period by classical Runge-Kutta."""
    robot, mode = model.robot, model.mode
    x, y, vx, vy, d1, d2, bias, clock, passive, fx, fy, errors = estimate
    applied = Applied(tau1 + d1, tau2 + d2, fx, fy)
    h = model.step
    half, sixth = 0.5 * h, h / 6.0
    for _ in range(model.steps):
        ax1, ay1 = platform_acceleration(robot, mode, x, y, vx, vy, applied)
        vx2, vy2 = vx + half * ax1, vy + half * ay1
        ax2, ay2 = platform_acceleration(robot, mode, x + half * vx, y + half * vy, vx2, vy2, applied)
        vx3, vy3 = vx + half * ax2, vy + half * ay2
        ax3, ay3 = platform_acceleration(robot, mode, x + half * vx2, y + half * vy2, vx3, vy3, applied)
        vx4, vy4 = vx + h * ax3, vy + h * ay3
        ax4, ay4 = platform_acceleration(robot, mode, x + h * vx3, y + h * vy3, vx4, vy4, applied)
        x, y = x + sixth * (vx + 2.0 * (vx2 + vx3) + vx4), y + sixth * (vy + 2.0 * (vy2 + vy3) + vy4)
        vx, vy = vx + sixth * (ax1 + 2.0 * (ax2 + ax3) + ax4), vy + sixth * (ay1 + 2.0 * (ay2 + ay3) + ay4)
    kept = math.sqrt(model.noise.force_kept)
    return Estimate(x, y, vx, vy, d1, d2, bias, clock, passive, kept * fx, kept * fy, errors)


def transition(model: FilterModel, middle: Estimate, tau1: float, tau2: float) -> Matrix:
    """Return the rows of F for x, y, vx, vy over one period, [4, 8].

    From the derivatives in its middle by the implicit trapezoidal rule.

    With da = P dp + V dv + G dd and W = 1 - V h/2 - P h^2/4: W dv' = (2 - W) dv + P h dp + G h dd and
    dp' = dp + (dv + dv') h/2. Second order, and bounded however steep the friction is around zero speed.
    """
    x, y, vx, vy = middle.x, middle.y, middle.vx, middle.vy
    applied = Applied(tau1 + middle.d1, tau2 + middle.d2, middle.fx, middle.fy)
    a = acceleration_derivatives(model.robot, model.mode, x, y, vx, vy, applied)
    h = model.period
    half, quarter = 0.5 * h, 0.25 * h * h
    w_xx = 1.0 - half * a.v_xx - quarter * a.p_xx
    w_xy = -half * a.v_xy - quarter * a.p_xy
    w_yx = -half * a.v_yx - quarter * a.p_yx
    w_yy = 1.0 - half * a.v_yy - quarter * a.p_yy
    determinant = w_xx * w_yy - w_xy * w_yx
    i_xx, i_xy, i_yx, i_yy = w_yy / determinant, -w_xy / determinant, -w_yx / determinant, w_xx / determinant
    # W^-1 (2 - W) = 2 W^-1 - 1
    u = (
        h * (i_xx * a.p_xx + i_xy * a.p_yx),
        h * (i_xx * a.p_xy + i_xy * a.p_yy),
        2.0 * i_xx - 1.0,
        2.0 * i_xy,
        h * (i_xx * a.t_x1 + i_xy * a.t_y1),
        h * (i_xx * a.t_x2 + i_xy * a.t_y2),
        h * (i_xx * a.f_xx + i_xy * a.f_xy),
        h * (i_xx * a.f_xy + i_xy * a.f_yy),
    )
    v = (
        h * (i_yx * a.p_xx + i_yy * a.p_yx),
        h * (i_yx * a.p_xy + i_yy * a.p_yy),
        2.0 * i_yx,
        2.0 * i_yy - 1.0,
        h * (i_yx * a.t_x1 + i_yy * a.t_y1),
        h * (i_yx * a.t_x2 + i_yy * a.t_y2),
        h * (i_yx * a.f_xx + i_yy * a.f_xy),
        h * (i_yx * a.f_xy + i_yy * a.f_yy),
    )
    rows = np.empty((4, 8))
    for column in range(8):
        rows[0, column], rows[1, column] = half * u[column], half * v[column]
        rows[2, column], rows[3, column] = u[column], v[column]
    # dp' = dp + (dv + dv') h/2
    rows[0, 0] += 1.0
    rows[1, 1] += 1.0
    rows[0, 2] += half
    rows[1, 3] += half
    return rows
