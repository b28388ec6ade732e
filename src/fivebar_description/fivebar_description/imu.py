# SPDX-License-Identifier: Apache-2.0
"""Mounting and characteristics of the IMU, for the plant that simulates it and the listener."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.sensors import (
    LARGEST_OFFSET,
    Latency,
    LostReadings,
    ReadingRate,
    ReadingSchedule,
    schedule_of,
)
from fivebar_description.settings import Setting

STANDARD_GRAVITY = 9.80665

Vector3 = tuple[float, float, float]

SATURATION = 0.999
"""Fraction of its range from which on an axis counts as at the end of it."""


def _turned(axis: str) -> Setting:
    return Setting(f"Rotation of the IMU {axis} of the link's frame.", "rad", at_least=-math.pi, at_most=math.pi)


class ImuSettings(NamedTuple):
    """An IMU fixed to the distal link of leg 2, which carries the end effector.

    The link's frame has its origin at the platform point, x along the link away from the elbow, z upwards. The robot
    lies in a horizontal plane. Roll, pitch and yaw are applied in this order about fixed axes. Noise, the gyroscope's
    offset, losses and the offset of its clock concern the simulation only; all else is known from the data sheet and a
    calibration at rest. From rate and latency the nodes also know when readings are missing, and from the gyroscope's
    low-pass by how much its readings lag behind.
    """

    noise: Annotated[
        float,
        Setting("Standard deviation of the accelerometer's white noise.", "m/s^2", at_least=0.0, at_most=100.0),
    ] = 0.0
    gravity: Annotated[float, Setting("Gravity at the robot.", "m/s^2", at_least=-100.0, at_most=100.0)] = (
        STANDARD_GRAVITY
    )
    bias: Annotated[Vector3, Setting("Offset of the accelerometer in its own frame: x, y, z.", "m/s^2")] = (
        0.0,
        0.0,
        0.0,
    )
    bandwidth_hz: Annotated[
        float,
        Setting("Cut-off of the accelerometer's first-order low-pass, 0 for none.", "Hz", at_least=0.0, at_most=1e5),
    ] = 0.0
    range: Annotated[
        float, Setting("Largest acceleration that an axis can measure.", "m/s^2", at_least=1.0, at_most=1e5)
    ] = 16.0 * STANDARD_GRAVITY
    gyro_noise: Annotated[
        float,
        Setting(
            "Standard deviation of the gyroscope's white noise, per reading; 0.003 to 0.02 for MEMS parts.",
            "rad/s",
            at_least=0.0,
            at_most=0.5,
        ),
    ] = 0.0
    gyro_bias: Annotated[
        float,
        Setting("Offset of the gyroscope; 0.01 to 0.05 for MEMS parts.", "rad/s", at_least=-10.0, at_most=10.0),
    ] = 0.0
    gyro_bandwidth_hz: Annotated[
        float,
        Setting(
            "Cut-off of the gyroscope's first-order low-pass, ahead of its sampling, 0 for none; 20 to 200 for MEMS"
            " parts.",
            "Hz",
            at_least=0.0,
            at_most=1e5,
        ),
    ] = 0.0
    gyro_range: Annotated[
        float,
        Setting(
            "Largest rate that an axis of the gyroscope can measure, no limit where null; 4.36 for 250 deg/s, 34.9 for"
            " 2000 deg/s. Readings at the end of the range are not used.",
            "rad/s",
            above=0.0,
            at_most=100.0,
            unlimited=True,
        ),
    ] = math.inf
    rate_hz: ReadingRate = 0
    latency: Latency = 0.0
    lost: LostReadings = 0.0
    clock_offset: Annotated[
        float,
        Setting(
            "Time by which the stamps of the IMU's clock are late; 0.001 to 0.01 where its driver has a clock of its"
            " own.",
            "s",
            at_least=-LARGEST_OFFSET,
            at_most=LARGEST_OFFSET,
        ),
    ] = 0.0
    mount_x: Annotated[
        float, Setting("Mounting point along the distal link, from the platform.", "m", at_least=-1.0, at_most=1.0)
    ] = 0.0
    mount_y: Annotated[float, Setting("Mounting point across the distal link.", "m", at_least=-1.0, at_most=1.0)] = 0.0
    roll: Annotated[float, _turned("about x")] = 0.0
    pitch: Annotated[float, _turned("about y")] = 0.0
    yaw: Annotated[float, _turned("about z")] = 0.0

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

    def turn_rate(self, angular_velocity: Vector3) -> float:
        """Return the rate of the link about its z axis (rad/s) from a reading in the IMU's own frame (rad/s)."""
        axis_x, axis_y, axis_z = self.rotation()[2]
        x, y, z = angular_velocity
        return axis_x * x + axis_y * y + axis_z * z

    def gyro_axes(self, rate: float) -> Vector3:
        """Return what the three axes read of a rate (rad/s) about the link's z axis, each within the range."""
        axis_x, axis_y, axis_z = self.rotation()[2]
        limit = self.gyro_range
        return (
            max(-limit, min(limit, axis_x * rate)),
            max(-limit, min(limit, axis_y * rate)),
            max(-limit, min(limit, axis_z * rate)),
        )

    def gyro_limit(self) -> float:
        """Return the rate (rad/s) about the link's z axis from which on an axis is at the end of its range."""
        largest = max(abs(component) for component in self.rotation()[2])
        return SATURATION * self.gyro_range / largest

    def usable_rate(self, angular_velocity: Vector3) -> float:
        """Return the rate of the link (rad/s) from a reading (rad/s), infinite where an axis is at its range's end."""
        if any(abs(rate) >= SATURATION * self.gyro_range for rate in angular_velocity):
            return math.inf
        return self.turn_rate(angular_velocity)

    def schedule(self, rate_hz: int) -> ReadingSchedule:
        """Return when readings are made and arrive, at a sampling rate (Hz)."""
        return schedule_of(self.rate_hz, self.latency, rate_hz)

    def smoothing(self, period: float) -> float:
        """Return the low-pass's weight of a new sample every `period` (s), 1 for no low-pass."""
        if self.bandwidth_hz == 0.0:
            return 1.0
        return 1.0 - math.exp(-2.0 * math.pi * self.bandwidth_hz * period)

    def gyro_lag(self, period: float) -> float:
        """Return the time (s) by which the gyroscope's low-pass lags behind, with samples every `period` (s).

        That is 1 / (2 pi f_c), at least the half period by which the mean over a period does.
        """
        if self.gyro_bandwidth_hz == 0.0:
            return 0.0
        return max(1.0 / (2.0 * math.pi * self.gyro_bandwidth_hz), 0.5 * period)

    def gyro_keep(self, period: float) -> float:
        """Return the weight of the low-pass's value before a period (s) in that after it, NaN for no low-pass.

        The rest is that of the period's mean rate. By the bilinear transform, so that a rate which grows evenly is
        late by just `gyro_lag`.
        """
        lag = self.gyro_lag(period)
        return (lag - 0.5 * period) / (lag + 0.5 * period) if lag > 0.0 else math.nan

    def lever(self, rate: float, rate_change: float) -> tuple[float, float]:
        """Return the acceleration of the mounting point relative to the platform point (m/s^2), in the link's frame.

        Args:
            rate: angular velocity of the link (rad/s).
            rate_change: its angular acceleration (rad/s^2).
        """
        return (
            -rate_change * self.mount_y - rate * rate * self.mount_x,
            rate_change * self.mount_x - rate * rate * self.mount_y,
        )
