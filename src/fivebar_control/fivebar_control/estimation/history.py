# SPDX-License-Identifier: Apache-2.0
"""The last samples of the filter, so that a late reading is applied at the time of its measurement.

A gyroscope's reading arrives some milliseconds after its stamp. The filter then goes back to the sample before that
stamp and repeats what followed, with the motor readings, torques and late readings of those samples.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_control.estimation.covariance import SIZE, Matrix
from fivebar_control.estimation.ekf import Belief, as_vector, from_vector
from fivebar_control.estimation.encoder import Angle
from fivebar_control.estimation.late_reading import SENSORS

ANGLE1, VARIANCE1, ANGLE2, VARIANCE2, TAU1, TAU2, PERIODS, SAMPLE = range(8)
"""Columns of the inputs: angle (rad) and variance (rad^2) of both motors, the torques (Nm) that were applied over the
periods since the entry before, and the sample."""

INPUTS = 8

VALUE, SECOND, LAG, VARIANCE, IS_NEW = range(5)
"""Columns of a late reading: its values (`LateReading`), the first of which is NaN for none, the time (s) from the
entry's sample to its stamp, its variance where readings differ in it, and whether an update has still to count its
innovation."""


class History(NamedTuple):
    """Ring buffers, entry k in row k modulo their length n; changed in place.

    Attributes:
        estimates: [n, SIZE], after all readings of the entry's sample.
        covariances: [n, SIZE^2], row by row; numba compiles the assignment of a vector sooner than that of a matrix.
        inputs: [n, INPUTS].
        late: [n, SENSORS, 5], the last reading of each late sensor in an entry.
    """

    estimates: Matrix
    covariances: Matrix
    inputs: Matrix
    late: Matrix


def empty_history(length: int) -> History:
    """Return a history of so many samples, two at least."""
    return History(
        np.zeros((length, SIZE)),
        np.zeros((length, SIZE * SIZE)),
        np.full((length, INPUTS), -1.0),
        np.full((length, SENSORS, 5), math.nan),
    )


def row_of(history: History, entry: int) -> int:
    """Return the row of an entry."""
    return entry % len(history.inputs)


def keep_inputs(history: History, entry: int, sample: int, periods: int, tau1: float, tau2: float) -> None:
    """Begin an entry: a sample, the periods since the entry before, and the torques (Nm) that were applied in them."""
    row = row_of(history, entry)
    inputs = history.inputs[row]
    inputs[SAMPLE], inputs[PERIODS], inputs[TAU1], inputs[TAU2] = sample, periods, tau1, tau2
    for sensor in range(SENSORS):
        history.late[row, sensor, VALUE] = math.nan


def keep_angles(history: History, entry: int, q11: Angle, q21: Angle) -> None:
    """Keep the measured motor angles of an entry."""
    inputs = history.inputs[row_of(history, entry)]
    inputs[ANGLE1], inputs[VARIANCE1] = q11.value, q11.variance
    inputs[ANGLE2], inputs[VARIANCE2] = q21.value, q21.variance


def angle_at(history: History, entry: int, number: int) -> Angle:
    """Return the measured angle of motor 1 or 2 of an entry."""
    inputs = history.inputs[row_of(history, entry)]
    if number == 1:
        return Angle(float(inputs[ANGLE1]), float(inputs[VARIANCE1]))
    return Angle(float(inputs[ANGLE2]), float(inputs[VARIANCE2]))


def entry_of(history: History, newest: int, sample: int) -> int:
    """Return the entry of a sample that takes readings, the newest one for later samples; 0 where there is none.

    The oldest entry takes none: there is nothing before it from which the filter could go on.
    """
    oldest = max(0, newest - len(history.inputs) + 1)
    for entry in range(newest, oldest, -1):
        at = history.inputs[row_of(history, entry), SAMPLE]
        if at == sample or (entry == newest and at < sample):
            return entry
    return 0


def keep_late(
    history: History,
    entry: int,
    sensor: int,
    value: float,
    lag: float,
    variance: float = math.nan,
    second: float = 0.0,
    counts: bool = True,
) -> None:
    """Keep a reading of a late sensor in an entry.

    Args:
        history: changed in place.
        entry: its entry.
        sensor: number of the sensor.
        value, second: of the reading.
        lag: time (s) from the entry's sample to the reading's stamp.
        variance: of the reading, NaN where all readings of the sensor have the same.
        counts: whether its first innovation counts among the sensor's.
    """
    late = history.late[row_of(history, entry), sensor]
    late[VALUE], late[SECOND], late[LAG], late[VARIANCE], late[IS_NEW] = value, second, lag, variance, counts


def keep_belief(history: History, entry: int, belief: Belief) -> None:
    """Keep the belief after all readings of an entry's sample."""
    row = row_of(history, entry)
    history.estimates[row] = as_vector(belief.estimate)
    history.covariances[row] = belief.covariance.reshape(SIZE * SIZE)


def belief_at(history: History, entry: int) -> Belief:
    """Return the belief after an entry."""
    row = row_of(history, entry)
    return Belief(from_vector(history.estimates[row]), history.covariances[row].copy().reshape(SIZE, SIZE))
