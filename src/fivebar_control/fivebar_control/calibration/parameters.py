# SPDX-License-Identifier: Apache-2.0
"""The parameters of a calibration, and how exactly they are known before."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fivebar_control.calibration.closure import GEOMETRY, geometry_of
from fivebar_description.parameters import FiveBar
from fivebar_description.tolerances import UNIFORM, Tolerances

FloatArray = NDArray[np.float64]

SENSOR = ("gyro_bias", "gyro_scale", "imu_delay")
"""Bias (rad/s), sensitivity and delay (s) of the gyroscope's readings."""

DRIVE = ("play_1", "play_2", "compliance_1", "compliance_2")
"""Lead of a motor over its link: half of the play (rad), and rad per Nm of torque."""

CAMERA = ("camera_x", "camera_y", "camera_turn", "camera_delay")
"""Where origin and axes of the camera's positions are in the robot's frame (m, rad), and the delay of its stamps (s).

Their scale is taken for right: it is the one that the calibration gets from them."""

PARAMETERS = (*GEOMETRY, *SENSOR, *DRIVE)
"""Calibrated parameters; with a camera's positions `CAMERA` besides."""

BIAS, SCALE, DELAY = range(len(GEOMETRY), len(GEOMETRY) + len(SENSOR))
PLAY = slice(DELAY + 1, DELAY + 3)
COMPLIANCE = slice(DELAY + 3, DELAY + 5)

SHIFT_X, SHIFT_Y, TURN, STAMPED = range(len(PARAMETERS), len(PARAMETERS) + len(CAMERA))

BIAS_BOUND, DELAY_BOUND, PLAY_BOUND = 0.2, 0.02, 1e-3
"""Standard deviations of the gyroscope's bias (rad/s) and delay (s), and of play (rad), before the calibration."""

SOFT = 40.0
"""Hz, of a leg's inertia on a transmission whose compliance is the standard deviation before the calibration."""

SHIFT_BOUND, TURN_BOUND, STAMP_BOUND = 1e-3, 5e-3, 5e-3
"""Standard deviations of the camera's origin (m), axes (rad) and delay (s) before the calibration."""

HELD = 1e-9
"""Standard deviation of a parameter whose tolerance is 0 (m, rad)."""


def values_before(robot: FiveBar, camera: bool = False) -> FloatArray:
    """Return all parameters, [15], before a calibration: the geometry of the robot, and nothing besides.

    With a camera [19].
    """
    besides = len(SENSOR) + len(DRIVE) + (len(CAMERA) if camera else 0)
    return np.concatenate((geometry_of(robot), np.zeros(besides)))


def deviations_before(robot: FiveBar, tolerances: Tolerances, camera: bool = False) -> FloatArray:
    """Return standard deviations of all parameters, [15] or, with a camera, [19], before a calibration.

    What a transmission yields is in proportion to the torques, and these to the inertia: a compliance is sized by it.
    """
    length, base, zero = (max(tolerance / UNIFORM, HELD) for tolerance in tolerances[:3])
    scale = max(tolerances.gyro_scale / UNIFORM, HELD)
    compliances = [1.0 / (leg.inertia * (2.0 * math.pi * SOFT) ** 2) for leg in (robot.leg1, robot.leg2)]
    drive = [PLAY_BOUND] * 2 + compliances
    seen = [SHIFT_BOUND, SHIFT_BOUND, TURN_BOUND, STAMP_BOUND] if camera else []
    return np.array([length] * 4 + [base] * 2 + [zero] * 2 + [BIAS_BOUND, scale, DELAY_BOUND, *drive, *seen])
