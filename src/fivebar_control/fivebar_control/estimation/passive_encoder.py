# SPDX-License-Identifier: Apache-2.0
"""The encoder on a passive joint: where its readings are put, and what they say of the state."""

from __future__ import annotations

import math

from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.covariance import PASSIVE as PASSIVE_ZERO
from fivebar_control.estimation.covariance import Vector
from fivebar_control.estimation.ekf import Belief, Estimate, FilterModel
from fivebar_control.estimation.encoder import Angle, first_angle, next_angle, repetitions
from fivebar_control.estimation.history import SAMPLE, belief_at, entry_of, keep_late, row_of
from fivebar_control.estimation.late_reading import PASSIVE
from fivebar_control.estimation.measurements import (
    Taken,
    ahead_of,
    distal_row,
    linearised,
    proximal_row,
    share_of_errors,
    taken,
)
from fivebar_control.estimation.platform_motion import LegMotion, leg_motion
from fivebar_control.estimation.readings import EstimatorMemory, Placed
from fivebar_description.parameters import LegParameters


def with_elbow(model: EstimatorModel, memory: EstimatorMemory, moment: float, reading: float) -> Placed:
    """Add a reading (rad) of the passive joint's encoder, to be taken by `next_update`; readings come in their order.

    One between two samples is moved to the later one by the speed that is expected.
    """
    newest, history = memory.newest, memory.history
    entry = entry_of(history, newest, math.ceil(moment))
    if entry == 0:
        return Placed(memory, newest)
    speed = elbow_speed(model.filter, belief_at(history, entry - 1).estimate, model.elbow)
    repeated = repetitions(memory.elbow, memory.elbow_repeated, reading)
    if math.isnan(memory.elbow):
        angle = first_angle(model.elbow_resolution, reading)
    else:
        angle = next_angle(model.elbow_resolution, model.elbow_rate, memory.elbow, repeated, reading, speed)
    since = (float(history.inputs[row_of(history, entry), SAMPLE]) - moment) / model.rate_hz
    keep_late(history, entry, PASSIVE, angle.value - model.elbow_zero + since * speed, 0.0, angle.variance)
    changed = EstimatorMemory(
        belief=memory.belief,
        newest=newest,
        last1=memory.last1,
        last2=memory.last2,
        before1=memory.before1,
        before2=memory.before2,
        repeated1=memory.repeated1,
        repeated2=memory.repeated2,
        elbow=reading,
        elbow_repeated=repeated,
        near=memory.near,
        misfit=memory.misfit,
        pattern=memory.pattern,
        gyro=memory.gyro,
        history=history,
    )
    return Placed(changed, entry)


def elbow_row(number: int, parameters: LegParameters, leg: LegMotion) -> Vector:
    """Return the derivatives of the reading of an encoder on leg 1's or leg 2's passive joint, q_i2 + zero, [SIZE]."""
    row = distal_row(number, parameters, leg) - proximal_row(number, leg)
    row[PASSIVE_ZERO] = 1.0
    return row


def elbow_turned(model: FilterModel, belief: Belief, number: int, reading: Angle) -> Taken:
    """Return the effect of the measured angle of leg 1's or leg 2's passive joint, in any turn."""
    e = belief.estimate
    x, y, vx, vy, passive = e.x, e.y, e.vx, e.vy, e.passive
    robot = model.robot
    parameters, mode = (robot.leg1, model.mode[0]) if number == 1 else (robot.leg2, model.mode[1])
    leg = leg_motion(parameters, mode, x, y, vx, vy)
    row = elbow_row(number, parameters, leg)
    innovation = ahead_of(reading.value - passive, leg.cos_q2, leg.sin_q2) - share_of_errors(e, row)
    return taken(belief, row, innovation, reading.variance + linearised(model, row))


def elbow_speed(model: FilterModel, estimate: Estimate, number: int) -> float:
    """Return the speed (rad/s) of the passive joint of leg 1 or leg 2."""
    x, y, vx, vy = estimate.x, estimate.y, estimate.vx, estimate.vy
    robot = model.robot
    parameters, mode = (robot.leg1, model.mode[0]) if number == 1 else (robot.leg2, model.mode[1])
    leg = leg_motion(parameters, mode, x, y, vx, vy)
    return leg.dtheta - leg.dq1
