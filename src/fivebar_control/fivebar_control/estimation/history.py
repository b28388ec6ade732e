"""The last samples of the filter, so that a late reading takes its place at the time at which it was made.

A gyroscope's reading arrives some milliseconds after its stamp. The filter then goes back to the sample before that
stamp and repeats what followed, with the motor readings, torques and gyroscope readings of those samples.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_control.estimation.covariance import BIAS, D1, D2, SIZE, STATES, VX, VY, Matrix, X, Y
from fivebar_control.estimation.ekf import Belief, Estimate
from fivebar_control.estimation.encoder import Angle

ANGLE1, VARIANCE1, ANGLE2, VARIANCE2, TAU1, TAU2, PERIODS, RATE, SAMPLE = range(9)
"""Columns of the inputs: angle (rad) and variance (rad^2) of both motors, the torques (Nm) that were applied over the
periods since the entry before, the gyroscope's reading (rad/s), NaN for none, and the sample."""


class History(NamedTuple):
    """Ring buffers, entry k in row k modulo their length n; changed in place.

    Attributes:
        estimates: [n, STATES], after all readings of the entry's sample.
        covariances: [n, SIZE^2], row by row; numba compiles the assignment of a vector sooner than that of a matrix.
        inputs: [n, 9].
    """

    estimates: Matrix
    covariances: Matrix
    inputs: Matrix


def empty_history(length: int) -> History:
    """Return a history of so many samples, two at least."""
    return History(np.zeros((length, STATES)), np.zeros((length, SIZE * SIZE)), np.full((length, SAMPLE + 1), -1.0))


def row_of(history: History, entry: int) -> int:
    """Return the row of an entry."""
    return entry % len(history.inputs)


def keep_inputs(history: History, entry: int, sample: int, periods: int, tau1: float, tau2: float) -> None:
    """Begin an entry: a sample, the periods since the entry before, and the torques (Nm) that were applied in them."""
    inputs = history.inputs[row_of(history, entry)]
    inputs[SAMPLE], inputs[PERIODS], inputs[RATE] = sample, periods, math.nan
    inputs[TAU1], inputs[TAU2] = tau1, tau2


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


def keep_rate(history: History, newest: int, sample: int, rate: float) -> int:
    """Keep a gyroscope reading (rad/s) of a sample; return its entry, or one after the newest where there is none.

    The oldest entry takes none: there is nothing before it from which the filter could go on.
    """
    oldest = max(0, newest - len(history.inputs) + 1)
    for entry in range(newest, oldest, -1):
        row = row_of(history, entry)
        if history.inputs[row, SAMPLE] == sample:
            history.inputs[row, RATE] = rate
            return entry
    return newest + 1


def keep_belief(history: History, entry: int, belief: Belief) -> None:
    """Keep the belief after all readings of an entry's sample."""
    row = row_of(history, entry)
    e = belief.estimate
    estimates = history.estimates[row]
    estimates[X], estimates[Y], estimates[VX], estimates[VY] = e.x, e.y, e.vx, e.vy
    estimates[D1], estimates[D2], estimates[BIAS] = e.d1, e.d2, e.bias
    history.covariances[row] = belief.covariance.reshape(SIZE * SIZE)


def belief_at(history: History, entry: int) -> Belief:
    """Return the belief after an entry."""
    row = row_of(history, entry)
    e = history.estimates[row]
    return Belief(
        Estimate(e[0], e[1], e[2], e[3], e[4], e[5], e[6]), history.covariances[row].copy().reshape(SIZE, SIZE)
    )
