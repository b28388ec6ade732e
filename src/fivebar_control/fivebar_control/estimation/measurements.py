# SPDX-License-Identifier: Apache-2.0
"""Measurement updates of the filter: those of the motor encoders, and what all sensors share.

Each measurement has a row, its derivatives with respect to all states and constant errors. It is expected to read what
the nominal geometry gives at the estimated state, plus the row's share of the estimated errors, which are small.
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
    ERRORS_END,
    FX,
    FY,
    L11,
    L12,
    L21,
    L22,
    PASSIVE,
    SIZE,
    VX,
    VY,
    ZERO1,
    ZERO2,
    Vector,
    X,
    Y,
    measured,
)
from fivebar_control.estimation.ekf import NO_ERRORS, Belief, Estimate, FilterModel, as_vector, from_vector
from fivebar_control.estimation.encoder import Angle
from fivebar_control.estimation.platform_motion import (
    LegMotion,
    leg_at_rest,
    leg_motion,
)
from fivebar_control.model.geometry import wrap
from fivebar_description.parameters import LegParameters

LINEARISATION = 0.1
"""Part of the constant errors' effect on an encoder that is added to its noise.

The rows are linearised at an estimate that is wrong itself. With encoders much better than the geometry a gain is the
small difference of large terms, which amplifies the error of the rows; the added noise bounds that.
"""


def homed_belief(model: FilterModel, x: float, y: float, variance: float) -> Belief:
    """Return the belief of a robot at rest whose platform the encoders put at (x, y) m.

    The position's error is N^-1 times that of the angles: of their noise, with a variance (rad^2), and of the
    constant errors, with which it is thus correlated.
    """
    leg1 = leg_at_rest(model.robot.leg1, model.mode[0], x, y)
    leg2 = leg_at_rest(model.robot.leg2, model.mode[1], x, y)
    determinant = leg1.n_x * leg2.n_y - leg1.n_y * leg2.n_x
    i_x1, i_x2 = leg2.n_y / determinant, -leg1.n_y / determinant
    i_y1, i_y2 = -leg2.n_x / determinant, leg1.n_x / determinant
    p = np.zeros((SIZE, SIZE))
    for index, deviation in enumerate(model.errors):
        p[ERRORS + index, ERRORS + index] = deviation * deviation
    row1, row2 = encoder_row(1, leg1), encoder_row(2, leg2)
    # the share of the constant errors in x and y
    share_x, share_y = -(i_x1 * row1 + i_x2 * row2), -(i_y1 * row1 + i_y2 * row2)
    with_x, with_y = p @ share_x, p @ share_y
    for index in range(ERRORS, ERRORS_END):
        p[X, index] = p[index, X] = with_x[index]
        p[Y, index] = p[index, Y] = with_y[index]
    p[X, X] = np.dot(share_x, with_x) + variance * (i_x1 * i_x1 + i_x2 * i_x2)
    p[Y, Y] = np.dot(share_y, with_y) + variance * (i_y1 * i_y1 + i_y2 * i_y2)
    p[X, Y] = np.dot(share_x, with_y) + variance * (i_x1 * i_y1 + i_x2 * i_y2)
    p[Y, X] = p[X, Y]
    p[VX, VX] = p[VY, VY] = model.noise.velocity
    p[D1, D1] = p[D2, D2] = model.disturbance_initial * model.disturbance_initial
    p[BIAS, BIAS] = model.gyro_bias * model.gyro_bias
    p[CLOCK_ERROR, CLOCK_ERROR] = model.gyro_clock * model.gyro_clock
    p[PASSIVE, PASSIVE] = model.passive_zero * model.passive_zero
    p[FX, FX] = p[FY, FY] = model.force_deviation * model.force_deviation
    return Belief(Estimate(x, y, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, NO_ERRORS), p)


def motor_speeds(model: FilterModel, estimate: Estimate) -> tuple[float, float]:
    """Return dq11 and dq21 (rad/s)."""
    x, y, vx, vy = estimate.x, estimate.y, estimate.vx, estimate.vy
    leg1 = leg_motion(model.robot.leg1, model.mode[0], x, y, vx, vy)
    return leg1.dq1, leg_motion(model.robot.leg2, model.mode[1], x, y, vx, vy).dq1


def proximal_row(number: int, leg: LegMotion) -> Vector:
    """Return the derivatives of the angle q_i1 of leg 1 or leg 2, [SIZE].

    From the closure of the leg at a given platform, projected onto u: b dq_1 = -u . dO - cos q_2 dl_1 - dl_2.
    """
    row = np.zeros(SIZE)
    row[X], row[Y] = leg.n_x, leg.n_y
    first = number == 1
    row[L11 if first else L21] = -leg.cos_q2 / leg.b
    row[L12 if first else L22] = -1.0 / leg.b
    row[BASE1 if first else BASE2] = -leg.u_x / leg.b
    return row


def distal_row(number: int, parameters: LegParameters, leg: LegMotion) -> Vector:
    """Return the derivatives of the distal link's angle theta_i of leg 1 or leg 2, [SIZE].

    The same closure projected onto r: l_2 sin q_2 dtheta = r . dO + dl_1 + cos q_2 dl_2.
    """
    row = np.zeros(SIZE)
    arm = 1.0 / (parameters.distal * leg.sin_q2)
    row[X], row[Y] = leg.w_x, leg.w_y
    first = number == 1
    row[L11 if first else L21] = arm
    row[L12 if first else L22] = leg.cos_q2 * arm
    row[BASE1 if first else BASE2] = leg.r_x * arm
    return row


def encoder_row(number: int, leg: LegMotion) -> Vector:
    """Return the derivatives of the reading of leg 1's or leg 2's motor encoder, q_i1 + zero, [SIZE]."""
    row = proximal_row(number, leg)
    row[ZERO1 if number == 1 else ZERO2] = 1.0
    return row


class Corrected(NamedTuple):
    """The effect of the motor encoders' readings.

    Attributes:
        belief: after them.
        misfit: squared innovations in units of their variance, 1 on average for each of the two as expected.
        ahead1, ahead2: the innovations in standard deviations: by how much each reading is ahead of its prediction.
    """

    belief: Belief
    misfit: float
    ahead1: float
    ahead2: float


def corrected(model: FilterModel, belief: Belief, q11: Angle, q21: Angle) -> Corrected:
    """Return the effect of the measured angles of both motors, in any turn."""
    x, y = belief.estimate.x, belief.estimate.y
    leg1 = leg_at_rest(model.robot.leg1, model.mode[0], x, y)
    leg2 = leg_at_rest(model.robot.leg2, model.mode[1], x, y)
    # one after the other, which for independent encoders is the same as both at once
    row1, row2 = encoder_row(1, leg1), encoder_row(2, leg2)
    update1 = measured(belief.covariance, row1, q11.variance + linearised(model, row1), model.estimates_errors)
    update2 = measured(update1.covariance, row2, q21.variance + linearised(model, row2), model.estimates_errors)
    innovation1 = ahead_of(q11.value, leg1.r_x, leg1.r_y) - share_of_errors(belief.estimate, row1)
    change = update1.gain * innovation1
    expected2 = share_of_errors(belief.estimate, row2) + float(np.dot(row2, change))
    innovation2 = ahead_of(q21.value, leg2.r_x, leg2.r_y) - expected2
    change += update2.gain * innovation2
    misfit = innovation1 * innovation1 / update1.variance + innovation2 * innovation2 / update2.variance
    ahead1, ahead2 = innovation1 / math.sqrt(abs(update1.variance)), innovation2 / math.sqrt(abs(update2.variance))
    return Corrected(Belief(changed(belief.estimate, change), update2.covariance), misfit, ahead1, ahead2)


def share_of_errors(estimate: Estimate, row: Vector) -> float:
    """Return what the estimated errors of robot and sensors add to the reading of a sensor with a row, [SIZE]."""
    total = 0.0
    for index, error in enumerate(estimate.errors):
        total += error * float(row[ERRORS + index])
    return total


def linearised(model: FilterModel, row: Vector) -> float:
    """Return the variance (rad^2) by which an encoder's row errs; 0 where geometry and zeros are exact."""
    total = 0.0
    for index, deviation in enumerate(model.errors):
        effect = LINEARISATION * deviation * float(row[ERRORS + index])
        total += effect * effect
    return total


def changed(estimate: Estimate, change: Vector) -> Estimate:
    """Return an estimate plus a change, [SIZE]."""
    return from_vector(as_vector(estimate) + change)


class Taken(NamedTuple):
    """The effect of a scalar reading.

    Attributes:
        belief: after it.
        misfit: squared innovation in units of its variance, 1 on average as expected.
        ahead: the innovation in standard deviations: by how much the reading is ahead of its prediction.
    """

    belief: Belief
    misfit: float
    ahead: float


def taken(belief: Belief, row: Vector, innovation: float, variance: float) -> Taken:
    """Return the effect of a reading by its row, innovation and the variance of its noise."""
    correction = measured(belief.covariance, row, variance)
    estimate = changed(belief.estimate, correction.gain * innovation)
    ahead = innovation / math.sqrt(abs(correction.variance))
    return Taken(Belief(estimate, correction.covariance), innovation * innovation / correction.variance, ahead)


def ahead_of(reading: float, x: float, y: float) -> float:
    """Return by how much a reading (rad) is ahead of the direction (x, y), in (-pi, pi]; NaN for no direction."""
    ahead = reading - math.atan2(y, x)
    return wrap(ahead) if math.isfinite(ahead) else math.nan
