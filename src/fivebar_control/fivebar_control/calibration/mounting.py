# SPDX-License-Identifier: Apache-2.0
"""How the IMU is mounted on the distal link: from the axis that it turns about and from its accelerometer.

The axis of turning in the IMU's frame gives roll and pitch. For the rest the accelerometer is compared with the motion
of the calibrated robot, without differentiating that twice: with a smooth weight phi, 0 at both ends of a window,

    int phi'' (P + R m) dt = int phi (R C f - R b - g) dt,

P being the platform, R the rotation of the link, m the mounting point in its frame, C the rotation by yaw, f the
levelled reading, b its bias in the link's frame and g what the base's tilt adds in the plane. All unknowns are linear.
The accelerometer gives no lengths: they are needed to 0.1 %, and its sensitivity is known to 1 %.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.calibration.record import CalibrationRecord, Turning
from fivebar_control.calibration.result import QUANTILE, Calibration
from fivebar_description.imu import STANDARD_GRAVITY

FloatArray = NDArray[np.float64]

WINDOW = 0.16
"""Length (s) of the windows; they overlap by half."""

LEAST_WINDOWS = 20

UNKNOWNS = ("cosine", "sine", "bias_x", "bias_y", "mount_x", "mount_y", "gravity_x", "gravity_y")


class Mounting(NamedTuple):
    """A mounting, each as value and half width of its interval: angles in rad, places in m, tilt in m/s^2.

    Attributes:
        roll, pitch, yaw, mount_x, mount_y: as in `ImuSettings`.
        tilt: largest part of gravity in the robot's plane.
        residual: of the weighted accelerations, root mean square (m/s^2).
    """

    roll: tuple[float, float]
    pitch: tuple[float, float]
    yaw: tuple[float, float]
    mount_x: tuple[float, float]
    mount_y: tuple[float, float]
    tilt: tuple[float, float]
    residual: float


def find_mounting(record: CalibrationRecord, calibration: Calibration) -> Mounting | None:
    """Return the mounting, None where there is no accelerometer, or the motion is too short for it."""
    if calibration.turning is None:
        return None
    inside = (record.imu_times >= calibration.times[0]) & (record.imu_times <= calibration.times[-1])
    times, readings = record.imu_times[inside], record.acceleration[inside]
    if not np.all(np.isfinite(readings)) or not np.any(np.ptp(readings, axis=0)):
        return None
    x, y, z = calibration.turning.axis
    roll, pitch = math.atan2(y, z), -math.asin(max(-1.0, min(1.0, x)))
    level = _levelling(roll, pitch) @ readings.T
    theta = np.interp(times, calibration.times, calibration.theta)
    place = np.stack([np.interp(times, calibration.times, column) for column in calibration.platform.T])
    centres = np.arange(times[0] + 0.5 * WINDOW, times[-1] - 0.5 * WINDOW, 0.5 * WINDOW)
    rows, right = [], []
    for centre in centres.tolist():
        some = np.flatnonzero(np.abs(times - centre) < 0.5 * WINDOW)
        if len(some) < 10 or np.max(np.diff(times[some])) > 3.0 * calibration.turning.period:
            continue
        phi, second = _weights((times[some] - centre) / (0.5 * WINDOW))
        cosine, sine = np.cos(theta[some]), np.sin(theta[some])
        f_x, f_y = level[0, some], level[1, some]
        # both rows of R f, of R turned by a right angle, and of R itself
        turned = np.array([cosine * f_x - sine * f_y, sine * f_x + cosine * f_y])
        rotation = np.array([[cosine, -sine], [sine, cosine]])
        block = np.empty((2, len(UNKNOWNS)))
        block[:, 0] = turned @ phi
        block[:, 1] = np.array([-turned[1] @ phi, turned[0] @ phi])
        block[:, 2:4] = -rotation @ phi
        block[:, 4:6] = -rotation @ second
        block[:, 6:8] = -np.eye(2) * np.sum(phi)
        rows.append(block)
        right.append(place[:, some] @ second)
    if len(rows) < LEAST_WINDOWS:
        return None
    return _solved(np.concatenate(rows), np.concatenate(right), roll, pitch, calibration.turning)


def _weights(u: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return phi and phi'' of (1 - u^2)^4 over -1 < u < 1, phi with the sum 1, both for time in s."""
    v = 1.0 - u * u
    phi = v**4
    second = (-8.0 * v**3 + 48.0 * u * u * v * v) / (0.5 * WINDOW) ** 2
    # the second derivative integrates to nothing, also where the samples lie off the middle
    second -= phi * np.sum(second) / np.sum(phi)
    return phi / np.sum(phi), second / np.sum(phi)


def _levelling(roll: float, pitch: float) -> FloatArray:
    cr, sr, cp, sp = math.cos(roll), math.sin(roll), math.cos(pitch), math.sin(pitch)
    return np.array([[cp, sp * sr, sp * cr], [0.0, cr, -sr], [-sp, cp * sr, cp * cr]])


def _solved(matrix: FloatArray, right: FloatArray, roll: float, pitch: float, turned: Turning) -> Mounting:
    scale = np.sqrt(np.sum(matrix**2, axis=0))
    solution, *_ = np.linalg.lstsq(matrix / scale, right, rcond=1e-9)
    values = solution / scale
    residual = right - matrix @ values
    # windows that overlap by half: every other one is independent
    variance = 2.0 * float(residual @ residual) / max(len(right) - len(values), 1)
    spread = np.sqrt(variance * np.diag(np.linalg.pinv((matrix / scale).T @ (matrix / scale)))) / scale * QUANTILE
    length = math.hypot(values[0], values[1])
    tilted = float(np.hypot(*spread[6:8]))
    across = QUANTILE * turned.noise / (float(np.std(turned.rates)) * math.sqrt(len(turned.rates)))
    return Mounting(
        roll=(roll, across),
        pitch=(pitch, across),
        yaw=(math.atan2(values[1], values[0]), float(max(spread[0], spread[1]) / length)),
        mount_x=(float(values[4]), float(spread[4])),
        mount_y=(float(values[5]), float(spread[5])),
        tilt=(float(math.hypot(values[6], values[7])), tilted),
        residual=math.sqrt(float(residual @ residual) / len(right)),
    )


def tilt_angle(tilt: float) -> float:
    """Return the angle (rad) between robot and horizontal for that part of gravity in the plane (m/s^2)."""
    return math.asin(min(1.0, tilt / STANDARD_GRAVITY))
