"""How an IMU is mounted and what it is like: known to the plant that simulates it and to the listener."""

from __future__ import annotations

import math
from typing import NamedTuple

STANDARD_GRAVITY = 9.80665

Vector3 = tuple[float, float, float]


class ImuDescription(NamedTuple):
    """An IMU fixed to the distal link of leg 2, which carries the end effector.

    The link's frame has its origin at the platform point, x along the link away from the elbow, z upwards.

    Attributes:
        gravity: acceleration of gravity (m/s^2); the robot lies in a horizontal plane.
        bias: constant offset of the accelerometer in its own frame (m/s^2), known from a calibration at rest.
        bandwidth_hz: cut-off of the accelerometer's first-order low-pass (Hz), 0 for none.
        range: largest magnitude that an axis can measure (m/s^2).
        mount_x, mount_y: where it is mounted, in the link's frame (m).
        roll, pitch, yaw: its orientation in the link's frame (rad), applied in this order about fixed axes.
    """

    gravity: float = STANDARD_GRAVITY
    bias: Vector3 = (0.0, 0.0, 0.0)
    bandwidth_hz: float = 0.0
    range: float = 16.0 * STANDARD_GRAVITY
    mount_x: float = 0.0
    mount_y: float = 0.0
    roll: float = 0.0
    pitch: float = 0.0
    yaw: float = 0.0

    def rotation(self) -> tuple[Vector3, Vector3, Vector3]:
        """Return the rows of the matrix R = Rz(yaw) Ry(pitch) Rx(roll), from the IMU's frame to the link's."""
        cr, sr = math.cos(self.roll), math.sin(self.roll)
        cp, sp = math.cos(self.pitch), math.sin(self.pitch)
        cy, sy = math.cos(self.yaw), math.sin(self.yaw)
        return (
            (cy * cp, cy * sp * sr - sy * cr, cy * sp * cr + sy * sr),
            (sy * cp, sy * sp * sr + cy * cr, sy * sp * cr - cy * sr),
            (-sp, cp * sr, cp * cr),
        )

    def smoothing(self, period: float) -> float:
        """Return the low-pass's weight of a new sample every `period` (s), 1 for no low-pass."""
        if self.bandwidth_hz == 0.0:
            return 1.0
        return 1.0 - math.exp(-2.0 * math.pi * self.bandwidth_hz * period)

    def lever(self, rate: float, rate_change: float) -> tuple[float, float]:
        """Return what the mounting point accelerates beyond the platform point (m/s^2), in the link's frame.

        Args:
            rate: angular velocity of the link (rad/s).
            rate_change: its angular acceleration (rad/s^2).
        """
        return (
            -rate_change * self.mount_y - rate * rate * self.mount_x,
            rate_change * self.mount_x - rate * rate * self.mount_y,
        )
