"""What a calibration finds, and how exactly it is known before."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fivebar_control.calibration.closure import GEOMETRY, geometry_of
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import Tolerances

FloatArray = NDArray[np.float64]

SENSOR = ("gyro_bias", "gyro_scale", "imu_delay")
"""Bias (rad/s), sensitivity and delay (s) of the gyroscope's readings."""

DRIVE = ("play_1", "play_2", "compliance_1", "compliance_2")
"""By how much a motor is ahead of its link: half of the play (rad), and rad per Nm of torque."""

PARAMETERS = (*GEOMETRY, *SENSOR, *DRIVE)
"""What is calibrated."""

BIAS, SCALE, DELAY = range(len(GEOMETRY), len(GEOMETRY) + len(SENSOR))
PLAY = slice(DELAY + 1, DELAY + 3)
COMPLIANCE = slice(DELAY + 3, DELAY + 5)

BIAS_BOUND, DELAY_BOUND, PLAY_BOUND, COMPLIANCE_BOUND = 0.2, 0.02, 1e-3, 1e-3
"""Standard deviations of the gyroscope's bias (rad/s) and delay (s), and of play (rad) and compliance (rad/Nm), before
the calibration."""

HELD = 1e-9
"""Standard deviation of a parameter whose tolerance is 0 (m, rad)."""


def values_before(robot: FiveBar) -> FloatArray:
    """Return all parameters, [15], before a calibration: the geometry of the robot, and nothing besides."""
    return np.concatenate((geometry_of(robot), np.zeros(len(SENSOR) + len(DRIVE))))


def deviations_before(tolerances: Tolerances) -> FloatArray:
    """Return standard deviations of all parameters, [15], before a calibration."""
    third = math.sqrt(3.0)
    length, base, zero = (max(one / third, HELD) for one in tolerances[:3])
    scale = max(tolerances.gyro_scale / third, HELD)
    drive = [PLAY_BOUND] * 2 + [COMPLIANCE_BOUND] * 2
    return np.array([length] * 4 + [base] * 2 + [zero] * 2 + [BIAS_BOUND, scale, DELAY_BOUND, *drive])
