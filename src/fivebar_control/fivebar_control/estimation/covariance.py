# SPDX-License-Identifier: Apache-2.0
"""The covariance of the filter over its states and the constant errors of the robot and its sensors.

The states are x, y (m), vx, vy (m/s), d1, d2 (Nm), the gyroscope's bias (rad/s), the offset of its clock (s), the zero
of a passive joint's encoder (rad) and the force on the platform (N). The entries from `ERRORS` on are constant: they
have no process noise, and begin with the variance that the declared tolerances give them. The filter therefore does not
take a constant error for noise that averages out; one that is known exactly has no variance and stays where it is. From
the motors' encoders alone the errors are considered, not estimated: nothing contradicts what the filter makes of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]
Vector = NDArray[np.float64]

X, Y, VX, VY, D1, D2, BIAS = range(7)
"""States of the motion, the drives and the gyroscope."""

ERRORS = 7

ZERO1, ZERO2, L11, L12, L21, L22, BASE1, BASE2, SCALE = range(ERRORS, 16)
"""Constant errors: zeros of the motor encoders (rad); lengths of the links, proximal and distal, and x of the base
joints (m), actual minus nominal; relative error of the gyroscope's sensitivity."""

ERRORS_END = 16

CLOCK_ERROR, PASSIVE, FX, FY = range(ERRORS_END, 20)
"""Constants of optional sensors: by how much the gyroscope's stamps are late (s), and the zero of a passive
joint's encoder (rad); and the force on the platform (N). They come last, so that without them all sums round as if they
did not exist."""

SIZE = 20


class ProcessNoise(NamedTuple):
    """Process noise of one period: white noise on both accelerations, and random walks.

    Attributes:
        position, mixed, velocity: variances and covariance of each coordinate and its rate (m^2, m^2/s, m^2/s^2).
        disturbance: variance of each disturbance (Nm^2).
        bias: variance of the gyroscope's bias (rad^2/s^2).
        clock: variance of the offset of its clock (s^2).
        force: variance of each component of the force on the platform (N^2).
        force_kept: share of that force that is still there after the period.
    """

    position: float
    mixed: float
    velocity: float
    disturbance: float
    bias: float
    clock: float
    force: float = 0.0
    force_kept: float = 1.0


def process_noise(
    acceleration_density: float,
    disturbance_rate: float,
    bias_rate: float,
    clock_rate: float,
    period: float,
    force_deviation: float = 0.0,
    force_time: float = 1.0,
) -> ProcessNoise:
    """Return the process noise over a period.

    Args:
        acceleration_density: of the platform's unexplained acceleration (m/s^2 per root Hz).
        disturbance_rate: of the disturbances' random walk (Nm per root s).
        bias_rate: of the bias' random walk (rad/s per root s).
        clock_rate: of the random walk of the clock's offset (s per root s).
        period: sampling period (s).
        force_deviation: standard deviation of each component of the force on the platform (N).
        force_time: its correlation time (s).
    """
    power = acceleration_density * acceleration_density
    force_kept = math.exp(-period / force_time)
    return ProcessNoise(
        position=power * period * period * period / 3.0,
        mixed=power * period * period / 2.0,
        velocity=power * period,
        disturbance=disturbance_rate * disturbance_rate * period,
        bias=bias_rate * bias_rate * period,
        clock=clock_rate * clock_rate * period,
        force=force_deviation * force_deviation * (1.0 - force_kept * force_kept),
        force_kept=force_kept,
    )


def propagated(covariance: Matrix, transition: Matrix, noise: ProcessNoise) -> Matrix:
    """Return F P F^T + Q.

    Args:
        covariance: P, [SIZE, SIZE].
        transition: the rows of F for x, y, vx, vy over the columns x, y, vx, vy, d1, d2 and the force: [4, 8]; all
            other entries are constant over a period, the force but for its decay.
        noise: of the period.
    """
    f = np.eye(SIZE)
    # entry by entry: to compile the assignment of a block takes numba seconds
    for row in range(4):
        for column in range(6):
            f[row, column] = transition[row, column]
        f[row, FX], f[row, FY] = transition[row, 6], transition[row, 7]
    f[FX, FX] = f[FY, FY] = noise.force_kept
    p = f @ covariance @ f.T
    # rounding makes it asymmetric, which no measurement takes back and an unstable motion lets grow
    p = 0.5 * (p + p.T)
    for axis in range(2):
        p[X + axis, X + axis] += noise.position
        p[VX + axis, VX + axis] += noise.velocity
        p[X + axis, VX + axis] += noise.mixed
        p[VX + axis, X + axis] += noise.mixed
        p[D1 + axis, D1 + axis] += noise.disturbance
        p[FX + axis, FX + axis] += noise.force
    p[BIAS, BIAS] += noise.bias
    p[CLOCK_ERROR, CLOCK_ERROR] += noise.clock
    return p


def with_torque_noise(covariance: Matrix, transition: Matrix, variance1: float, variance2: float) -> Matrix:
    """Return the covariance after a period whose torques are uncertain.

    Args:
        covariance: P after the period, [SIZE, SIZE].
        transition: as for :func:`propagated`; its columns `D1` and `D2` are the effect of each motor's torque.
        variance1, variance2: of the torques (Nm^2).
    """
    p = covariance.copy()
    for row in range(4):
        for column in range(4):
            p[row, column] += variance1 * transition[row, D1] * transition[column, D1]
            p[row, column] += variance2 * transition[row, D2] * transition[column, D2]
    return p


class Correction(NamedTuple):
    """A scalar measurement's effect.

    Attributes:
        covariance: after it, [SIZE, SIZE].
        gain: of its innovation, [SIZE]; 0 for what is known exactly, and for errors that are considered only.
        variance: of its innovation.
    """

    covariance: Matrix
    gain: Vector
    variance: float


def measured(covariance: Matrix, row: Vector, variance: float, estimates_errors: bool = True) -> Correction:
    """Return the effect of a measurement `row . (states, constant errors) + noise`.

    The gain is P H^T / S; with one that is not the optimal one for all entries, P - K H P - P H^T K^T + K S K^T is the
    covariance.

    Args:
        covariance: P, [SIZE, SIZE].
        row: H, [SIZE].
        variance: of the noise.
        estimates_errors: whether constant errors get a gain; else they are considered only (Schmidt-Kalman filter).
    """
    column = covariance @ row
    total = float(np.dot(row, column)) + variance
    gain = column / total
    if not estimates_errors:
        gain[ERRORS:ERRORS_END] = 0.0
    half = gain.reshape(SIZE, 1) * (column - 0.5 * total * gain)
    return Correction(covariance - (half + half.T), gain, total)
