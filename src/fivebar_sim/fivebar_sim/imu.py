"""The simulated IMU: accelerometer and gyroscope readings of the exact motion."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_description.imu import ImuSettings, Vector3
from fivebar_sim.effects.gyroscope import NO_FAULTS, GyroscopeFaults, frozen_samples, gain, jump


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


def sensed_rate(keep: float, before: float, mean: float, rate: float) -> float:
    """Return the rate (rad/s) that a gyroscope senses at the end of a period, without its errors.

    Args:
        keep: see `ImuSettings.gyro_keep`.
        before: what it sensed at the beginning of the period (rad/s).
        mean: rate in the period (rad/s). A gyroscope samples far more often than it is read, so that what vibrates
            within the period averages out.
        rate: at the end of the period (rad/s), which is what is sensed without a low-pass.
    """
    return rate if math.isnan(keep) else keep * before + (1.0 - keep) * mean


class Gyroscope:
    """A gyroscope about the axis of the distal link of leg 2, without the end of its range."""

    def __init__(self, settings: ImuSettings, rate_hz: int, seed: int, faults: GyroscopeFaults = NO_FAULTS) -> None:
        """Make a gyroscope with its own random stream, to be read first at sample 0."""
        self._settings = settings
        self._period = 1.0 / rate_hz
        self._keep = settings.gyro_keep(self._period)
        self._random = gyro_stream(seed)
        self._sensed: float | None = None
        self._angle = 0.0
        self._rate_hz, self._faults = rate_hz, faults
        self._gain, self._frozen = gain(faults), frozen_samples(faults, rate_hz)
        self._number, self._reading = 0, 0.0

    def read(self, angle: float, rate: float, periods: int = 1) -> float:
        """Return the reading (rad/s) of a sample some periods after the one before.

        Args:
            angle: of the link (rad), in any turn but without jumps.
            rate: its angular velocity (rad/s).
            periods: since the sample before.
        """
        if self._sensed is None:
            self._sensed = rate
        else:
            self._number += periods
            mean = (angle - self._angle) / (periods * self._period)
            self._sensed = sensed_rate(self._keep**periods, self._sensed, mean, rate)
        self._angle = angle
        error = float(gyro_errors(self._settings, self._random, 1)[0])
        if not self._frozen.has(self._number):
            error += jump(self._faults, self._rate_hz, self._number)
            self._reading = self._gain * self._sensed + error
        return self._reading


class Imu:
    """A three-axis accelerometer and gyroscope on the distal link of leg 2."""

    def __init__(
        self,
        settings: ImuSettings,
        rate_hz: int,
        seed: int,
        tilt: float = 0.0,
        faults: GyroscopeFaults = NO_FAULTS,
    ) -> None:
        """Create an IMU with its own random stream, on a robot whose base is tilted (rad)."""
        self._settings = settings
        self._rotation = np.array(settings.rotation())
        self._smoothing = settings.smoothing(1.0 / rate_hz)
        self._gravity = settings.gravity * math.cos(tilt)
        self._random = np.random.default_rng([seed, 1])
        self._gyroscope = Gyroscope(settings, rate_hz, seed, faults)
        self._filtered: np.ndarray | None = None

    def read(self, acceleration: tuple[float, float], angle: float, rate: float, rate_change: float) -> ImuReading:
        """Return the reading of one sample; call it once per sample.

        Args:
            acceleration: exact acceleration of the platform point in the distal link's frame, less the part of gravity
                in the robot's plane (m/s^2).
            angle: of the link (rad), without jumps.
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
        turning = self._gyroscope.read(angle, rate)
        return ImuReading((x, y, z), imu.gyro_axes(turning))
