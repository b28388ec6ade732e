# SPDX-License-Identifier: Apache-2.0
"""The zero of an encoder on a passive joint, from a calibrated recording.

With the geometry and theta_2 that a calibration has found, every sample gives the passive joint's angle; the zero is
the mean of what the encoder reads beyond it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_control.calibration.closure import BASE_1, L_11, ZERO_1, ZERO_2
from fivebar_control.calibration.least_squares import BLOCK
from fivebar_control.calibration.record import LONGEST_GAP, CalibrationRecord, FloatArray, NotCalibratable
from fivebar_control.calibration.record import angles as smooth_angles
from fivebar_control.calibration.result import QUANTILE, Calibration
from fivebar_control.identification.cutoff import encoder_resolution

LEAST_BLOCKS = 3
"""Fewest stretches of `BLOCK` seconds from which the mean's scatter is taken."""


class PassiveReadings(NamedTuple):
    """Readings of an encoder on a passive joint.

    Attributes:
        leg: 1 or 2.
        times: [n], of the readings, on the clock of the motors' (s).
        angles: [n], in any turn (rad).
    """

    leg: int
    times: FloatArray
    angles: FloatArray


class PassiveZero(NamedTuple):
    """The zero of leg 1's or leg 2's passive encoder, the reading where the angle is 0, and its half width (rad)."""

    leg: int
    value: float
    half_width: float


def find_passive_zero(record: CalibrationRecord, calibration: Calibration, readings: PassiveReadings) -> PassiveZero:
    """Return the zero of an encoder on a passive joint.

    Raises:
        NotCalibratable: too few of its readings fall into the time that the calibration has used.
    """
    angles = passive_angles(record, calibration, readings.leg)
    after = np.clip(np.searchsorted(calibration.times, readings.times), 1, len(calibration.times) - 1)
    inside = (readings.times >= calibration.times[0]) & (readings.times <= calibration.times[-1])
    inside &= calibration.times[after] - calibration.times[after - 1] <= LONGEST_GAP
    times = readings.times[inside]
    # a reading stands for a whole count
    read = readings.angles[inside] + 0.5 * encoder_resolution(readings.angles.reshape(-1, 1))
    beyond = read - np.interp(times, calibration.times, np.unwrap(angles))
    if not len(times):
        raise NotCalibratable("no reading of the passive joint's encoder falls into the time of the motion")
    middle = math.atan2(float(np.mean(np.sin(beyond))), float(np.mean(np.cos(beyond))))
    left = (beyond - middle + np.pi) % (2.0 * np.pi) - np.pi
    _, block = np.unique(np.floor(times / BLOCK), return_inverse=True)
    means = np.bincount(block, weights=left) / np.bincount(block)
    if len(means) < LEAST_BLOCKS:
        raise NotCalibratable("the passive joint's encoder has read for too short a time")
    scatter = QUANTILE * float(np.std(means, ddof=1)) / math.sqrt(len(means))
    zero = ZERO_1 if readings.leg == 1 else ZERO_2
    return PassiveZero(
        readings.leg, middle + float(np.mean(left)), math.hypot(scatter, float(calibration.half_widths[zero]))
    )


def passive_angles(record: CalibrationRecord, calibration: Calibration, leg: int) -> FloatArray:
    """Return q_i2 of a leg (rad), [k], at the samples that a calibration has used."""
    number = leg - 1
    read = np.interp(calibration.times, record.times, smooth_angles(record).values[:, number])
    motor = read - calibration.values[(ZERO_1, ZERO_2)[number]]
    if leg == 2:
        return np.asarray(calibration.theta - motor)
    base, proximal = calibration.values[BASE_1], calibration.values[L_11]
    to_x = calibration.platform[:, 0] - base - proximal * np.cos(motor)
    to_y = calibration.platform[:, 1] - proximal * np.sin(motor)
    return np.asarray(np.arctan2(to_y, to_x) - motor)
