"""An extended Kalman filter of the platform's motion from the two motor encoders and the applied torques.

The state is (x, y, vx, vy, d1, d2): the platform's position and velocity, and one disturbance torque per motor as a
random walk. It lives in platform coordinates because (x, working mode) fixes the joint angles on both sides of the
Type 2 locus: the measurement, the inverse geometry of the two motor angles, is single-valued there, and so the filter
follows a change of assembly mode without a switch, as long as the estimated velocity shows that the robot crossed.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_control.estimation.covariance import (
    Covariance,
    ProcessNoise,
    Transition,
    Vector6,
    diagonal,
    measured,
    process_noise,
    propagated,
)
from fivebar_control.estimation.encoder import Angle
from fivebar_control.estimation.platform_motion import (
    acceleration_derivatives,
    leg_motion,
    platform_acceleration,
)
from fivebar_control.model.geometry import wrap
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import Setting

STIFFNESS_LIMIT = 2.0
"""Largest product of the friction's rate and an integration step; classical Runge-Kutta is stable up to 2.78."""


class Estimate(NamedTuple):
    """Platform position (m) and velocity (m/s), disturbance torque of each motor (Nm)."""

    x: float
    y: float
    vx: float
    vy: float
    d1: float
    d2: float


class Belief(NamedTuple):
    """An estimate and its covariance."""

    estimate: Estimate
    covariance: Covariance


class EkfSettings(NamedTuple):
    """Noise assumptions of the filter, limits of its validity, and the use of its estimates.

    On the locus the uncertainty along t_s grows with the acceleration noise, since no motor torque acts on the platform
    in that direction (1.19).
    """

    acceleration_noise: Annotated[
        float,
        Setting(
            "Density of the platform acceleration that the model does not explain.",
            "m/s^2 per root Hz",
            at_least=1e-6,
            at_most=1e3,
        ),
    ] = 0.02
    disturbance_rate: Annotated[
        float,
        Setting("Density of the disturbance torques' random walk.", "Nm per root s", at_least=0.0, at_most=1e3),
    ] = 1.0
    disturbance_initial: Annotated[
        float,
        Setting("Standard deviation of the disturbance torques at the start.", "Nm", at_least=0.0, at_most=1e3),
    ] = 0.1
    homing_tolerance: Annotated[
        float,
        Setting("Largest angle between an encoder and the declared homing posture.", "rad", at_least=1e-6, at_most=1.0),
    ] = 0.02
    mirror_deviations: Annotated[
        float,
        Setting(
            "Distance of the other assembly mode, in standard deviations, below which the estimate is ambiguous.",
            at_least=0.0,
            at_most=1e3,
        ),
    ] = 5.0
    dwell_limit: Annotated[
        float,
        Setting(
            "Time near the Type 2 locus after which the estimate is ambiguous, whatever the deviations.",
            "s",
            at_least=1e-3,
            at_most=1e6,
        ),
    ] = 0.2
    feed_forward: Annotated[
        bool,
        Setting("Whether laws without an observer of their own compensate the estimated disturbance torques."),
    ] = True


class FilterModel(NamedTuple):
    """Constants of the filter's steps.

    Attributes:
        robot, mode1, mode2: the nominal robot and its working mode.
        period: sampling period (s).
        step, steps: of the integration, over half a period (s).
        noise: process noise of one period.
        disturbance_initial: standard deviation of each disturbance at the start (Nm).
    """

    robot: FiveBar
    mode1: int
    mode2: int
    period: float
    step: float
    steps: int
    noise: ProcessNoise
    disturbance_initial: float


def filter_model(robot: FiveBar, mode1: int, mode2: int, rate_hz: int, settings: EkfSettings) -> FilterModel:
    """Return it for a robot in a working mode at a sampling rate; the step is one that the friction's slope allows."""
    period = 1.0 / rate_hz
    stiffness = max(leg.coulomb / (leg.width * leg.inertia) for leg in (robot.leg1, robot.leg2))
    steps = max(1, math.ceil(0.5 * period * stiffness / STIFFNESS_LIMIT))
    noise = process_noise(settings.acceleration_noise, settings.disturbance_rate, period)
    return FilterModel(robot, mode1, mode2, period, 0.5 * period / steps, steps, noise, settings.disturbance_initial)


def homed_belief(model: FilterModel, x: float, y: float, variance: float) -> Belief:
    """Return the belief of a robot at rest whose platform the encoders put at (x, y) m.

    The position's covariance is (N^T N)^-1 times the variance (rad^2) of the angles.
    """
    leg1 = leg_motion(model.robot.leg1, model.mode1, x, y, 0.0, 0.0)
    leg2 = leg_motion(model.robot.leg2, model.mode2, x, y, 0.0, 0.0)
    determinant = leg1.n_x * leg2.n_y - leg1.n_y * leg2.n_x
    scale = variance / (determinant * determinant)
    xx = scale * (leg1.n_y * leg1.n_y + leg2.n_y * leg2.n_y)
    yy = scale * (leg1.n_x * leg1.n_x + leg2.n_x * leg2.n_x)
    xy = -scale * (leg1.n_x * leg1.n_y + leg2.n_x * leg2.n_y)
    still = model.noise.velocity
    disturbance = model.disturbance_initial * model.disturbance_initial
    _, _, p2, p3, p4, p5 = diagonal((xx, yy, still, still, disturbance, disturbance))
    covariance = ((xx, xy, 0.0, 0.0, 0.0, 0.0), (xy, yy, 0.0, 0.0, 0.0, 0.0), p2, p3, p4, p5)
    return Belief(Estimate(x, y, 0.0, 0.0, 0.0, 0.0), covariance)


def predicted(model: FilterModel, belief: Belief, tau1: float, tau2: float) -> Belief:
    """Return the belief one period later, under torques (Nm) that were applied throughout it."""
    middle = _half(model, belief.estimate, tau1, tau2)
    later = _half(model, middle, tau1, tau2)
    return Belief(later, propagated(belief.covariance, transition(model, middle, tau1, tau2), model.noise))


def advanced(model: FilterModel, estimate: Estimate, tau1: float, tau2: float) -> Estimate:
    """Return the estimate one period later, without its covariance."""
    return _half(model, _half(model, estimate, tau1, tau2), tau1, tau2)


def _half(model: FilterModel, estimate: Estimate, tau1: float, tau2: float) -> Estimate:
    """Integrate over half a period by classical Runge-Kutta."""
    robot, mode1, mode2 = model.robot, model.mode1, model.mode2
    x, y, vx, vy, d1, d2 = estimate
    g1, g2 = tau1 + d1, tau2 + d2
    h = model.step
    half, sixth = 0.5 * h, h / 6.0
    for _ in range(model.steps):
        ax1, ay1 = platform_acceleration(robot, mode1, mode2, x, y, vx, vy, g1, g2)
        vx2, vy2 = vx + half * ax1, vy + half * ay1
        ax2, ay2 = platform_acceleration(robot, mode1, mode2, x + half * vx, y + half * vy, vx2, vy2, g1, g2)
        vx3, vy3 = vx + half * ax2, vy + half * ay2
        ax3, ay3 = platform_acceleration(robot, mode1, mode2, x + half * vx2, y + half * vy2, vx3, vy3, g1, g2)
        vx4, vy4 = vx + h * ax3, vy + h * ay3
        ax4, ay4 = platform_acceleration(robot, mode1, mode2, x + h * vx3, y + h * vy3, vx4, vy4, g1, g2)
        x, y = x + sixth * (vx + 2.0 * (vx2 + vx3) + vx4), y + sixth * (vy + 2.0 * (vy2 + vy3) + vy4)
        vx, vy = vx + sixth * (ax1 + 2.0 * (ax2 + ax3) + ax4), vy + sixth * (ay1 + 2.0 * (ay2 + ay3) + ay4)
    return Estimate(x, y, vx, vy, d1, d2)


def transition(model: FilterModel, middle: Estimate, tau1: float, tau2: float) -> Transition:
    """Return F over one period, from the derivatives in its middle by the implicit trapezoidal rule.

    With da = P dp + V dv + G dd and W = 1 - V h/2 - P h^2/4: W dv' = (2 - W) dv + P h dp + G h dd and
    dp' = dp + (dv + dv') h/2. Second order, and bounded however steep the friction is around zero speed.
    """
    x, y, vx, vy, d1, d2 = middle
    a = acceleration_derivatives(model.robot, model.mode1, model.mode2, x, y, vx, vy, tau1 + d1, tau2 + d2)
    h = model.period
    half, quarter = 0.5 * h, 0.25 * h * h
    w_xx = 1.0 - half * a.v_xx - quarter * a.p_xx
    w_xy = -half * a.v_xy - quarter * a.p_xy
    w_yx = -half * a.v_yx - quarter * a.p_yx
    w_yy = 1.0 - half * a.v_yy - quarter * a.p_yy
    determinant = w_xx * w_yy - w_xy * w_yx
    i_xx, i_xy, i_yx, i_yy = w_yy / determinant, -w_xy / determinant, -w_yx / determinant, w_xx / determinant
    # W^-1 (2 - W) = 2 W^-1 - 1
    u: Vector6 = (
        h * (i_xx * a.p_xx + i_xy * a.p_yx),
        h * (i_xx * a.p_xy + i_xy * a.p_yy),
        2.0 * i_xx - 1.0,
        2.0 * i_xy,
        h * (i_xx * a.t_x1 + i_xy * a.t_y1),
        h * (i_xx * a.t_x2 + i_xy * a.t_y2),
    )
    v: Vector6 = (
        h * (i_yx * a.p_xx + i_yy * a.p_yx),
        h * (i_yx * a.p_xy + i_yy * a.p_yy),
        2.0 * i_yx,
        2.0 * i_yy - 1.0,
        h * (i_yx * a.t_x1 + i_yy * a.t_y1),
        h * (i_yx * a.t_x2 + i_yy * a.t_y2),
    )
    return (
        (1.0 + half * u[0], half * u[1], half * (1.0 + u[2]), half * u[3], half * u[4], half * u[5]),
        (half * v[0], 1.0 + half * v[1], half * v[2], half * (1.0 + v[3]), half * v[4], half * v[5]),
        u,
        v,
    )


def motor_speeds(model: FilterModel, estimate: Estimate) -> tuple[float, float]:
    """Return dq11 and dq21 (rad/s)."""
    x, y, vx, vy, _, _ = estimate
    leg1 = leg_motion(model.robot.leg1, model.mode1, x, y, vx, vy)
    return leg1.dq1, leg_motion(model.robot.leg2, model.mode2, x, y, vx, vy).dq1


def corrected(model: FilterModel, belief: Belief, q11: Angle, q21: Angle) -> Belief:
    """Return the belief after the angles of both motors were measured, in any turn."""
    x, y, vx, vy, d1, d2 = belief.estimate
    leg1 = leg_motion(model.robot.leg1, model.mode1, x, y, 0.0, 0.0)
    leg2 = leg_motion(model.robot.leg2, model.mode2, x, y, 0.0, 0.0)
    innovation1 = _ahead(q11.value, leg1.r_x, leg1.r_y)
    innovation2 = _ahead(q21.value, leg2.r_x, leg2.r_y)
    # one after the other, which for independent encoders is the same as both at once
    covariance, k = measured(belief.covariance, leg1.n_x, leg1.n_y, q11.variance)
    dx, dy = k[0] * innovation1, k[1] * innovation1
    rest = innovation2 - leg2.n_x * dx - leg2.n_y * dy
    covariance, g = measured(covariance, leg2.n_x, leg2.n_y, q21.variance)
    return Belief(
        Estimate(
            x + dx + g[0] * rest,
            y + dy + g[1] * rest,
            vx + k[2] * innovation1 + g[2] * rest,
            vy + k[3] * innovation1 + g[3] * rest,
            d1 + k[4] * innovation1 + g[4] * rest,
            d2 + k[5] * innovation1 + g[5] * rest,
        ),
        covariance,
    )


def _ahead(reading: float, r_x: float, r_y: float) -> float:
    """Return by how much a reading (rad) is ahead of the direction r, in (-pi, pi]; NaN for no direction."""
    ahead = reading - math.atan2(r_y, r_x)
    return wrap(ahead) if math.isfinite(ahead) else math.nan
