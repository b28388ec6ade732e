# SPDX-License-Identifier: Apache-2.0
"""The gyroscope on the distal link of leg 2: where its readings are put, and what they say of the state."""

from __future__ import annotations

import math

import numpy as np

from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.covariance import BASE2, BIAS, CLOCK_ERROR, L21, L22, SCALE, SIZE, VX, VY, Vector, X, Y
from fivebar_control.estimation.ekf import Belief, Estimate, FilterModel
from fivebar_control.estimation.gyro_watch import GyroHeard, not_used, used
from fivebar_control.estimation.history import SAMPLE, belief_at, entry_of, keep_late, row_of
from fivebar_control.estimation.late_reading import GYROSCOPE
from fivebar_control.estimation.measurements import Taken, distal_row, proximal_row, share_of_errors, taken
from fivebar_control.estimation.platform_motion import LegMotion, leg_motion, turn_change
from fivebar_control.estimation.readings import EstimatorMemory, Placed, changed_memory
from fivebar_description.parameters import LegParameters

EARLIEST = 0.02
"""Time (s) by which the stamp of a reading may be ahead of the newest sample: beyond it, its clock is wrong."""


def with_rate(model: EstimatorModel, memory: EstimatorMemory, stamped: float, rate: float) -> Placed:
    """Add a gyroscope reading (rad/s).

    It is put at the first sample at or after the moment at which it was made, by what is known and estimated of its
    clock, and at the newest one at the latest. A reading of sample 0, or of one that is no longer in the history, is
    left out, and so is an infinite one, at the end of its range, or one whose stamp is far ahead of the newest sample,
    and so are all once the estimate is lost for good, NaN in all that it has.

    Args:
        model: constants.
        memory: with the motor readings with which it came.
        stamped: moment of its stamp, in samples.
        rate: reading.
    """
    newest, rate_hz = memory.newest, model.rate_hz
    stamp = stamped - model.gyro_clock * rate_hz
    moment = stamp - memory.belief.estimate.clock * rate_hz
    entry = 0 if math.isnan(moment) else entry_of(memory.history, newest, math.ceil(moment))
    if -1.0 < moment <= 0.0:
        # of sample 0, which is there already
        return Placed(memory, newest)
    early = moment > memory.history.inputs[row_of(memory.history, newest), SAMPLE] + EARLIEST * rate_hz
    if entry == 0 or early or not math.isfinite(rate):
        return Placed(with_gyro(memory, not_used(memory.gyro, rate, early)), newest)
    at = float(memory.history.inputs[row_of(memory.history, entry), SAMPLE])
    keep_late(memory.history, entry, GYROSCOPE, rate, (stamp - at) / rate_hz)
    expected = turn_rate(model.filter, belief_at(memory.history, entry - 1).estimate)
    return Placed(with_gyro(memory, used(memory.gyro, rate, expected)), entry)


def with_gyro(memory: EstimatorMemory, gyro: GyroHeard) -> EstimatorMemory:
    """Return a memory in which something else has been heard of the gyroscope."""
    return changed_memory(memory, memory.belief, memory.near, memory.misfit, memory.pattern, gyro)


def turn_rate(model: FilterModel, estimate: Estimate) -> float:
    """Return the rate of the distal link of leg 2 (rad/s)."""
    x, y, vx, vy = estimate.x, estimate.y, estimate.vx, estimate.vy
    return leg_motion(model.robot.leg2, model.mode[1], x, y, vx, vy).dtheta


def turn_row(parameters: LegParameters, leg: LegMotion, vx: float, vy: float) -> Vector:
    """Return the derivatives of the reading of a gyroscope on leg 2's distal link, w_2 . xdot + bias, [SIZE].

    Whatever turns both links, the platform or an error of the geometry at a given platform, turns w_2.
    """
    proximal, distal = proximal_row(2, leg), distal_row(2, parameters, leg)
    row = np.zeros(SIZE)
    for column in (X, Y, L21, L22, BASE2):
        row[column] = turn_change(parameters, leg, vx, vy, proximal[column], distal[column])
    row[L22] -= leg.dtheta / parameters.distal
    row[VX], row[VY], row[BIAS], row[SCALE] = leg.w_x, leg.w_y, 1.0, leg.dtheta
    return row


def turned(model: FilterModel, belief: Belief, rate: float, lag: float, slope: float) -> Taken:
    """Return the effect of the measured rate of the distal link of leg 2: w_2 . xdot + bias + noise.

    Args:
        model: constants.
        belief: at a sample.
        rate: reading (rad/s).
        lag: time (s) from the sample to the reading's stamp, negative for one before it.
        slope: change of the rate in that time (rad/s^2).
    """
    e = belief.estimate
    x, y, vx, vy, bias, clock = e.x, e.y, e.vx, e.vy, e.bias, e.clock
    leg = model.robot.leg2
    moving = leg_motion(leg, model.mode[1], x, y, vx, vy)
    row = turn_row(leg, moving, vx, vy)
    row[CLOCK_ERROR] = -slope
    innovation = rate - (moving.dtheta + slope * (lag - clock)) - bias - share_of_errors(e, row)
    return taken(belief, row, innovation, model.gyro_noise * model.gyro_noise)
