"""The simulated IMU: accelerometer and gyroscope readings of the exact motion."""

from __future__ import annotations

from collections import deque
from typing import Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from fivebar_description.imu import ImuSettings, Vector3

T = TypeVar("T")


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


class ReadingQueue(Generic[T]):
    """Sampling, latency and loss of an IMU's readings: made at every n-th sample, late, some lost.

    Call `arrived` once per sample.
    """

    def __init__(self, settings: ImuSettings, rate_hz: int, seed: int) -> None:
        """Make an empty queue; the seed is that of the losses."""
        self._schedule = settings.schedule(rate_hz)
        self._lost = settings.lost
        self._random = loss_stream(seed)
        self._waiting: deque[tuple[int, T]] = deque()

    def arrived(self, sample: int, reading: T) -> list[tuple[int, T]]:
        """Return what arrives with a sample, given its own reading: the sample of each reading, and the reading."""
        lost = bool(self._random.random() < self._lost)
        if sample % self._schedule.every == 0 and not lost:
            self._waiting.append((sample, reading))
        arriving = []
        while self._waiting and self._waiting[0][0] + self._schedule.latency <= sample:
            arriving.append(self._waiting.popleft())
        return arriving


def loss_stream(seed: int) -> np.random.Generator:
    """Return the random stream of lost readings: one number for each sample, below the lost fraction for a loss."""
    return np.random.default_rng([seed, 3])


def lost_readings(settings: ImuSettings, seed: int, samples: int) -> NDArray[np.bool_]:
    """Return which of the readings of samples 0, 1, ... never arrive, [samples]."""
    lost: NDArray[np.bool_] = loss_stream(seed).random(samples) < settings.lost
    return lost


class Imu:
    """A three-axis accelerometer and gyroscope on the distal link of leg 2."""

    def __init__(self, settings: ImuSettings, rate_hz: int, seed: int) -> None:
        """Create an IMU with its own random stream."""
        self._settings = settings
        self._rotation = np.array(settings.rotation())
        self._smoothing = settings.smoothing(1.0 / rate_hz)
        self._random = np.random.default_rng([seed, 1])
        self._gyro_random = gyro_stream(seed)
        self._filtered: np.ndarray | None = None

    def read(self, acceleration: tuple[float, float], rate: float, rate_change: float) -> ImuReading:
        """Return the reading of one sample; call it once per sample.

        Args:
            acceleration: exact acceleration of the platform point in the distal link's frame (m/s^2).
            rate: angular velocity of the link (rad/s).
            rate_change: angular acceleration of the link (rad/s^2).
        """
        imu = self._settings
        lever_x, lever_y = imu.lever(rate, rate_change)
        # at rest an accelerometer measures the reaction to gravity
        force = np.array([acceleration[0] + lever_x, acceleration[1] + lever_y, imu.gravity])
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
