"""The simulated IMU: accelerometer and gyroscope readings of the exact motion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_description.imu import ImuSettings, Vector3


class ImuReading(NamedTuple):
    """An IMU sample in the IMU's own frame: linear acceleration (m/s^2) and angular velocity (rad/s)."""

    acceleration: Vector3
    angular_velocity: Vector3


def gyro_stream(seed: int) -> np.random.Generator:
    """Return the random stream of the gyroscope's noise, apart from that of the accelerometer."""
    return np.random.default_rng([seed, 2])


def gyro_errors(settings: ImuSettings, stream: np.random.Generator, samples: int) -> NDArray[np.float64]:
    """Return the errors of the gyroscope's next readings (rad/s), [samples]: its offset and noise."""
    if settings.gyro_noise == 0.0:
        return np.full(samples, settings.gyro_bias)
    return settings.gyro_bias + stream.normal(0.0, settings.gyro_noise, samples)


class Imu:
    """A three-axis accelerometer and gyroscope on the distal link of leg 2."""

    def __init__(self, settings: ImuSettings, rate_hz: int, seed: int, tilt: float = 0.0) -> None:
        """Create an IMU with its own random stream, on a robot whose base is tilted (rad)."""
        self._settings = settings
        self._rotation = np.array(settings.rotation())
        self._smoothing = settings.smoothing(1.0 / rate_hz)
        self._gravity = settings.gravity * math.cos(tilt)
        self._random = np.random.default_rng([seed, 1])
        self._gyro_random = gyro_stream(seed)
        self._filtered: np.ndarray | None = None

    def read(self, acceleration: tuple[float, float], rate: float, rate_change: float) -> ImuReading:
        """Return the reading of one sample; call it once per sample.

        Args:
            acceleration: exact acceleration of the platform point in the distal link's frame, less the part of gravity
                in the robot's plane (m/s^2).
            rate: angular velocity of the link (rad/s).
            rate_change: angular acceleration of the link (rad/s^2).
        """
        imu = self._settings
        lever_x, lever_y = imu.lever(rate, rate_change)
        # at rest an accelerometer measures the reaction to gravity
        force = np.array([acceleration[0] + lever_x, acceleration[1] + lever_y, self._gravity])
        measured = self._rotation.T @ force
        if self._filtered is None:
            self._filtered = measured
        self._filtered = self._filtered + self._smoothing * (measured - self._filtered)
        reading = self._filtered + np.array(imu.bias)
        if imu.noise > 0.0:
            reading = reading + self._random.normal(0.0, imu.noise, 3)
        x, y, z = np.clip(reading, -imu.range, imu.range).tolist()
        turning = rate + gyro_errors(imu, self._gyro_random, 1)[0]
        rate_x, rate_y, rate_z = (self._rotation.T @ np.array([0.0, 0.0, turning])).tolist()
        return ImuReading((x, y, z), (rate_x, rate_y, rate_z))
