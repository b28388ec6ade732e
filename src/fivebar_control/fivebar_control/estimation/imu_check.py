# SPDX-License-Identifier: Apache-2.0
"""The acceleration check of section 4.3: an independent check that the platform follows its reference."""

from __future__ import annotations

import math

from fivebar_control.model.kinematics import distal_acceleration, state_from_platform
from fivebar_control.model.state import Platform, WorkingMode
from fivebar_description.imu import SATURATION, ImuSettings, Vector3
from fivebar_description.parameters import FiveBar


class ImuCheck:
    """Compares the magnitude of the measured acceleration with the desired one, sample by sample.

    The IMU's own contributions are removed: its bias, its orientation, gravity, and the acceleration of its mounting
    point relative to the platform point. The last one and the low-pass are computed from the reference, so that the
    measured side is a measurement only.
    """

    def __init__(self, robot: FiveBar, mode: WorkingMode, rate_hz: int, imu: ImuSettings) -> None:
        """Bind the check to a robot in a working mode and to its IMU."""
        self._robot = robot
        self._modes = mode
        self._imu = imu
        self._rotation = imu.rotation()
        self._smoothing = imu.smoothing(1.0 / rate_hz)
        self._expected: tuple[float, float, float, float] | None = None

    def error(self, measured: Vector3, desired: Platform) -> float:
        """Return the measured minus the desired magnitude of the platform's acceleration (m/s^2).

        Call it once for every sample, since the low-pass has a state.

        Args:
            measured: the accelerometer's reading (m/s^2) in its own frame.
            desired: the reference of the same sample.
        """
        desired_x, desired_y, lever_x, lever_y = self._filtered(self._expectation(desired))
        along, across = self._in_link_frame(measured)
        return math.hypot(along - lever_x, across - lever_y) - math.hypot(desired_x, desired_y)

    def saturated(self, measured: Vector3) -> bool:
        """Return whether an axis is at the end of its range, so that the reading is not usable."""
        return any(abs(component) >= SATURATION * self._imu.range for component in measured)

    def _in_link_frame(self, measured: Vector3) -> tuple[float, float]:
        """Return the in-plane part of the reading; gravity is along the third axis where the robot is level."""
        b_x, b_y, b_z = self._imu.bias
        x, y, z = measured[0] - b_x, measured[1] - b_y, measured[2] - b_z
        row_x, row_y, _ = self._rotation
        return row_x[0] * x + row_x[1] * y + row_x[2] * z, row_y[0] * x + row_y[1] * y + row_y[2] * z

    def _expectation(self, desired: Platform) -> tuple[float, float, float, float]:
        """Return the desired platform acceleration, and the lever's less gravity in the plane, in the link's frame."""
        state = state_from_platform(self._robot, self._modes, desired.x, desired.y, desired.vx, desired.vy)
        leg = state.leg2
        rate_change = distal_acceleration(self._robot.leg2, leg, desired.ax, desired.ay)
        lever_x, lever_y = self._imu.lever(leg.dtheta, rate_change)
        # at rest an accelerometer measures the reaction to gravity
        g_x, g_y = self._robot.gravity_x, self._robot.gravity_y
        return (
            leg.u_x * desired.ax + leg.u_y * desired.ay,
            leg.u_x * desired.ay - leg.u_y * desired.ax,
            lever_x - leg.u_x * g_x - leg.u_y * g_y,
            lever_y - leg.u_x * g_y + leg.u_y * g_x,
        )

    def _filtered(self, values: tuple[float, float, float, float]) -> tuple[float, float, float, float]:
        if self._expected is None:
            self._expected = values
        weight = self._smoothing
        x, y, lever_x, lever_y = self._expected
        self._expected = (
            x + weight * (values[0] - x),
            y + weight * (values[1] - y),
            lever_x + weight * (values[2] - lever_x),
            lever_y + weight * (values[3] - lever_y),
        )
        return self._expected


def noise_floor(noise: float, desired_magnitude: float) -> float:
    """Return the root mean square error (m/s^2) that white noise alone leaves under perfect tracking.

    With standard deviation s per axis it is between s, where the acceleration is much larger than the noise, and
    sqrt(2) s, where it is zero: the magnitude of a noisy vector follows the Rice distribution.
    """
    if noise == 0.0:
        return 0.0
    # here, because a run checks its IMU without it
    from scipy.special import i0e, i1e

    a, s = desired_magnitude, noise
    # the mean of that distribution, with scaled Bessel functions that do not overflow where a is much larger than s
    x = (a / (2.0 * s)) ** 2
    mean = s * math.sqrt(0.5 * math.pi) * float((1.0 + 2.0 * x) * i0e(x) + 2.0 * x * i1e(x))
    return math.sqrt(max(0.0, 2.0 * s * s + 2.0 * a * a - 2.0 * a * mean))
