# SPDX-License-Identifier: Apache-2.0
"""The data of a calibration: recorded angles and angular velocities, made ready."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline

from fivebar_control.identification.cutoff import encoder_resolution
from fivebar_description.imu import Vector3

FloatArray = NDArray[np.float64]

LONGEST_GAP = 0.02
"""Time (s) without a reading over which the gyroscope is not integrated."""

LEAST_NOISE = 1e-4
"""Least noise (rad/s) that is assumed of a reading of the gyroscope: a smooth curve passes through its readings."""

EXACT_ANGLE = 1e-5
"""Standard deviation (rad) that is assumed of angles that are not counts: encoders are no better."""

LEAST_CHANGES = 20
"""Fewest changes of an encoder's reading."""

ROUNDING = 3.0
"""Variance that is assumed of an angle from counts, relative to that of rounding: the rounding errors of neighbouring
counts are alike. Found by the coverage of the intervals."""


class NotCalibratable(ValueError):
    """The recording does not allow a calibration; the message says what is missing."""


CONTRADICTS = "the recording contradicts the robot"


class ContradictsRobot(NotCalibratable):
    """The recording is not that of the robot, or its sensors are others than is said of them."""


class CalibrationRecord(NamedTuple):
    """Readings of a motion.

    Attributes:
        times: [n], of the motors' readings (s).
        motors: [n, 2], q_11 and q_21 as their encoders read them (rad).
        torques: [n, 2], of the motors (Nm), 0 where they have no power.
        imu_times: [m], of the readings of the IMU (s).
        angular_velocity: [m, 3], in the IMU's frame (rad/s).
        acceleration: [m, 3], in the IMU's frame (m/s^2).
    """

    times: FloatArray
    motors: FloatArray
    torques: FloatArray
    imu_times: FloatArray
    angular_velocity: FloatArray
    acceleration: FloatArray


class TouchedPoint(NamedTuple):
    """A measured place of the platform: readings of both motors there (rad), x and y (m), and their deviation (m)."""

    q11: float
    q21: float
    x: float
    y: float
    deviation: float


class SeenPositions(NamedTuple):
    """The platform by a camera during the motion.

    Attributes:
        times: [m], stamps of the exposures (s).
        positions: [m, 2], x and y in the frame of the camera's marks (m), NaN where it was not seen.
        deviations: [m], their standard deviations (m).
    """

    times: FloatArray
    positions: FloatArray
    deviations: FloatArray


NOT_SEEN = SeenPositions(np.zeros(0), np.zeros((0, 2)), np.zeros(0))


class Turning(NamedTuple):
    """The gyroscope's readings about the axis of the distal link.

    Attributes:
        axis: the link's z axis in the IMU's frame.
        rates: [m], readings about it (rad/s).
        noise: their standard deviation (rad/s).
        period: median time between two readings (s).
    """

    axis: Vector3
    rates: FloatArray
    noise: float
    period: float


class Angles(NamedTuple):
    """The motors' angles, [n, 2] (rad), with their variances (rad^2) and the encoders' count (rad), 0 for none."""

    values: FloatArray
    variances: FloatArray
    resolution: float


def turning(record: CalibrationRecord, expected: Vector3) -> Turning:
    """Return the readings about the axis that the link turns about, the direction in which they vary most.

    Args:
        record: readings.
        expected: that axis in the IMU's frame, roughly; it gives the sign.

    Raises:
        NotCalibratable: the link hardly turns.
    """
    axis, spread = turning_axis(record.angular_velocity, expected)
    rates = record.angular_velocity @ axis
    noise = max(_white_noise(rates), LEAST_NOISE)
    if spread[0] < 10.0 * noise * np.sqrt(len(rates)):
        raise NotCalibratable(
            f"the distal link hardly turns: {np.std(rates):.3g} rad/s, expected more than ten times the noise"
        )
    x, y, z = axis.tolist()
    return Turning((x, y, z), rates, noise, float(np.median(np.diff(record.imu_times))))


def turning_axis(angular_velocity: FloatArray, expected: Vector3) -> tuple[FloatArray, FloatArray]:
    """Return the direction in which readings vary most, with the sign of an expected one, and their spread.

    The spread has the singular values of the readings, [3], the largest first.
    """
    varying = angular_velocity - angular_velocity.mean(axis=0)
    _, spread, directions = np.linalg.svd(varying, full_matrices=False)
    return directions[0] * np.sign(directions[0] @ np.array(expected) or 1.0), spread


def _white_noise(values: FloatArray) -> float:
    """Return the standard deviation of white noise on a smooth signal, from its third differences."""
    third = np.diff(values, 3)
    return float(np.median(np.abs(third)) / (0.6745 * np.sqrt(20.0))) if third.size else 0.0


class Turned:
    """The integral of the gyroscope's readings, and where it holds."""

    def __init__(self, times: FloatArray, turning: Turning) -> None:
        """Integrate the cubic spline through the readings."""
        self._times = times
        self._rate = CubicSpline(times, turning.rates)
        self._angle = self._rate.antiderivative()

    def between(self, times: FloatArray, delay: float) -> FloatArray:
        """Return [n - 1], the readings' integral (rad) between neighbouring times, for stamps `delay` (s) late."""
        return np.diff(self._angle(times + delay))

    def change(self, times: FloatArray, delay: float) -> FloatArray:
        """Return [n - 1], the derivative of `between` by the delay (rad/s)."""
        return np.diff(self._rate(times + delay))

    def known(self, times: FloatArray) -> NDArray[np.bool_]:
        """Return [n - 1], where no reading is missing between neighbouring times."""
        before = np.clip(np.searchsorted(self._times, times[:-1], side="right") - 1, 0, len(self._times) - 1)
        after = np.clip(np.searchsorted(self._times, times[1:], side="left"), 0, len(self._times) - 1)
        known: NDArray[np.bool_] = np.diff(self._times, append=np.inf)[before] <= LONGEST_GAP
        return known & (self._times[after] - times[1:] <= LONGEST_GAP)


def angles(record: CalibrationRecord) -> Angles:
    """Return the motors' angles: of counts a smooth curve through the moments at which they change.

    A reading stands for a whole count, and its mean error is not zero where a motor reverses, which both do on the
    Type 2 locus: the angle dwells in one half of the last count. So the angle is read from a curve through the counts'
    edges, within the count of the reading.
    """
    resolution = encoder_resolution(record.motors)
    if resolution == 0.0:
        return Angles(record.motors, np.full(record.motors.shape, EXACT_ANGLE**2), resolution)
    values, variances = np.empty_like(record.motors), np.empty_like(record.motors)
    for motor in range(2):
        readings = record.motors[:, motor]
        changed = np.flatnonzero(np.diff(readings))
        if len(changed) < LEAST_CHANGES:
            raise NotCalibratable(f"motor {motor + 1} hardly turns: its encoder changes {len(changed)} times")
        moments = 0.5 * (record.times[changed] + record.times[changed + 1])
        edges = 0.5 * (readings[changed] + readings[changed + 1] + resolution)
        inside = np.clip(record.times, moments[0], moments[-1])
        values[:, motor] = np.clip(CubicSpline(moments, edges)(inside), readings, readings + resolution)
        lengths = np.diff(np.concatenate(([0], changed + 1, [len(readings)])))
        variances[:, motor] = ROUNDING * resolution**2 / 12.0 * np.repeat(lengths, lengths)
    return Angles(values, variances, resolution)
