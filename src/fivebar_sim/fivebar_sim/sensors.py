# SPDX-License-Identifier: Apache-2.0
"""Encoders, drives and IMU of the simulated robot: quantisation, limits, errors, delay; readings rare, late or lost."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection
from typing import Any, Generic, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from fivebar_description.imu import ImuSettings, Vector3
from fivebar_description.sensors import LateSensor
from fivebar_sim.effects.gyroscope import (
    NO_FAULTS,
    GyroscopeFaults,
    SampleSpan,
    frozen_samples,
    gain,
    jump,
    missing_samples,
)
from fivebar_sim.effects.settings import PlantSettings

IMU_LOSSES, PASSIVE_LOSSES, EXTRA_LOSSES = 3, 4, 7
"""Random streams of the lost readings of each sensor."""

NONE = SampleSpan(0, 0)

T = TypeVar("T")


def counted(angle: float, resolution: float) -> float:
    """Return an angle (rad) rounded down to a count of `resolution` (rad)."""
    return math.floor(angle / resolution) * resolution


def shaped(torque: float, quantum: float, limit: float) -> float:
    """Return a torque (Nm) quantised to the nearest step, where that is not 0, and saturated at the limit."""
    if quantum > 0.0:
        torque = round(torque / quantum) * quantum
    return max(-limit, min(limit, torque))


def drive_limit(settings: PlantSettings) -> float:
    """Return the largest torque (Nm) that the drives apply, infinite for no limit."""
    return math.inf if settings.torque_limit is None else settings.torque_limit


def encoder_resolution(settings: PlantSettings) -> float:
    """Return the angle of an encoder's count (rad), 0 for exact sensors."""
    counts = settings.encoder_counts
    return 0.0 if counts is None or counts == 0 else 2.0 * math.pi / counts


class Encoder:
    """One joint's encoder: position rounded down to a count, velocity as the difference of two samples."""

    def __init__(self, counts: int, period: float) -> None:
        """Make an encoder with `counts` per revolution, read every `period` (s)."""
        self._resolution = 2.0 * math.pi / counts
        self._period = period
        self._previous: float | None = None

    def read(self, angle: float) -> tuple[float, float]:
        """Return the measured angle (rad) and velocity (rad/s); the velocity of the first reading is 0."""
        measured = counted(angle, self._resolution)
        velocity = 0.0 if self._previous is None else (measured - self._previous) / self._period
        self._previous = measured
        return measured, velocity


class TorqueOutput:
    """The two motor drives: a delay in whole samples, a torque step and a torque limit, and commands that are lost."""

    def __init__(self, settings: PlantSettings, lost: Collection[int] = ()) -> None:
        """Start at zero torque; `lost` are the samples whose commands do not arrive, so that the one before is held."""
        self._lost = lost
        self._number = -settings.delay_samples
        self._held = (0.0, 0.0)
        self._quantum = settings.torque_quantum
        self._limit = drive_limit(settings)
        self._waiting = deque([(0.0, 0.0)] * settings.delay_samples)

    def apply(self, command: tuple[float, float]) -> tuple[float, float]:
        """Take a new torque command (Nm) and return the torques (Nm) that act now.

        Raises:
            ValueError: a torque is not a number; limiting it would turn it into the limit.
        """
        if math.isnan(command[0]) or math.isnan(command[1]):
            raise ValueError(f"torque command {command} Nm is not a number")
        self._waiting.append(command)
        arrived = self._waiting.popleft()
        if self._number not in self._lost:
            self._held = arrived
        self._number += 1
        tau1, tau2 = self._held
        return shaped(tau1, self._quantum, self._limit), shaped(tau2, self._quantum, self._limit)


class ReadingQueue(Generic[T]):
    """Readings that are made at every n-th sample, and arrive late, some lost.

    Call `arrived` once per sample.
    """

    def __init__(
        self, settings: LateSensor, rate_hz: int, seed: int, losses: int = IMU_LOSSES, missing: SampleSpan = NONE
    ) -> None:
        """Make an empty queue.

        Args:
            settings: of the sensor.
            rate_hz: samples per second.
            seed: of the losses.
            losses: random stream of the losses, of which each sensor has its own.
            missing: samples whose readings never arrive besides.
        """
        self._missing = missing
        self._schedule = settings.schedule(rate_hz)
        self._lost = settings.lost
        # one number for each sample, below the lost fraction for a loss
        self._random = np.random.default_rng([seed, losses])
        self._waiting: deque[tuple[int, T]] = deque()

    def arrived(self, sample: int, reading: T) -> list[tuple[int, T]]:
        """Return what arrives with a sample, given its own reading: the sample of each reading, and the reading."""
        lost = bool(self._random.random() < self._lost) or self._missing.has(sample)
        if sample % self._schedule.every == 0 and not lost:
            self._waiting.append((sample, reading))
        arriving = []
        while self._waiting and self._waiting[0][0] + self._schedule.latency <= sample:
            arriving.append(self._waiting.popleft())
        return arriving


def imu_queue(settings: ImuSettings, faults: GyroscopeFaults, rate_hz: int, seed: int) -> ReadingQueue[Any]:
    """Return an empty queue of an IMU's readings; the arguments are those of `ImuClock`, which stamps them."""
    return ReadingQueue(settings, rate_hz, seed, missing=missing_samples(faults, rate_hz))


def lost_readings(settings: LateSensor, seed: int, samples: int, losses: int = IMU_LOSSES) -> NDArray[np.bool_]:
    """Return which of the readings of samples 0, 1, ... never arrive, [samples]."""
    lost: NDArray[np.bool_] = np.random.default_rng([seed, losses]).random(samples) < settings.lost
    return lost


def made_readings(
    settings: LateSensor,
    rate_hz: int,
    seed: int,
    samples: int,
    losses: int = IMU_LOSSES,
    missing: SampleSpan = NONE,
) -> NDArray[np.bool_]:
    """Return at which of the samples 0, 1, ... a reading is made that arrives, [samples]; arguments as of the queue."""
    due: NDArray[np.bool_] = np.arange(samples) % settings.schedule(rate_hz).every == 0
    due[missing.first : missing.end] = False
    return due & ~lost_readings(settings, seed, samples, losses)


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
