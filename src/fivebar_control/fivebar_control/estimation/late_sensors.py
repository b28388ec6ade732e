# SPDX-License-Identifier: Apache-2.0
"""The sensors whose readings come late, each with a module of its own: one list of readings, and one history."""

from __future__ import annotations

from fivebar_control.estimation.camera import CAMERA_GATE, seen_at, with_seen
from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.covariance import Vector
from fivebar_control.estimation.ekf import Belief
from fivebar_control.estimation.encoder import Angle
from fivebar_control.estimation.extra_sensor import extra_taken, with_extra
from fivebar_control.estimation.gyroscope import turned, with_rate
from fivebar_control.estimation.history import LAG, SECOND, VALUE, VARIANCE
from fivebar_control.estimation.late_reading import CAMERA, GYROSCOPE, PASSIVE, Readings
from fivebar_control.estimation.measurements import Taken
from fivebar_control.estimation.passive_encoder import elbow_turned, with_elbow
from fivebar_control.estimation.readings import EstimatorMemory, Placed, with_motors


def with_readings(
    model: EstimatorModel,
    memory: EstimatorMemory,
    sample: int,
    periods: int,
    q11: float,
    q21: float,
    tau1: float,
    tau2: float,
    readings: Readings,
) -> Placed:
    """Return the memory with all readings that came with a sample, to be taken by `next_update`.

    Args:
        model: constants.
        memory: of the readings before.
        sample, periods, q11, q21, tau1, tau2: the motors', see `with_motors`.
        readings: of the late sensors.
    """
    memory = with_motors(memory, sample, periods, q11, q21, tau1, tau2)
    start = memory.newest
    for number in range(len(readings)):
        reading = readings[number]
        sensor, moment, value = reading[0], reading[1], reading[2]
        if sensor == GYROSCOPE:
            placed = with_rate(model, memory, moment, value)
        elif sensor == PASSIVE:
            placed = with_elbow(model, memory, moment, value)
        elif sensor == CAMERA:
            placed = with_seen(model, memory, moment, value, reading[3], reading[4] * reading[4])
        else:
            placed = with_extra(model, memory, moment, value)
        memory, start = placed.memory, min(start, placed.start)
    return Placed(memory, start)


def effect_of(model: EstimatorModel, belief: Belief, sensor: int, late: Vector, slope: float) -> Taken:
    """Return the effect of a late reading on the belief at its sample.

    Args:
        model: constants.
        belief: at the sample of its entry.
        sensor: number of the sensor.
        late: the reading, as the history has it.
        slope: change of the gyroscope's rate in that time (rad/s^2).
    """
    value, lag = float(late[VALUE]), float(late[LAG])
    if sensor == GYROSCOPE:
        return turned(model.filter, belief, value, lag, slope)
    if sensor == PASSIVE:
        return elbow_turned(model.filter, belief, model.elbow, Angle(value, float(late[VARIANCE])))
    if sensor == CAMERA:
        return seen_at(belief, value, float(late[SECOND]), lag, float(late[VARIANCE]), CAMERA_GATE)
    return extra_taken(model, belief, value, lag, float(late[VARIANCE]))
