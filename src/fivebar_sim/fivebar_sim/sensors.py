"""What the sensors and drives make of exact figures: encoder counts, torque steps and limits, accelerometer noise."""

from __future__ import annotations

import math
from collections import deque
from typing import NamedTuple

import numpy as np

from fivebar_sim.options import ImuOptions, PlantOptions


class Encoder:
    """One joint's encoder: position rounded down to a count, velocity as the difference of two samples."""

    def __init__(self, counts: int, period: float) -> None:
        """Make an encoder with `counts` per revolution, read every `period` (s)."""
        self._resolution = 2.0 * math.pi / counts
        self._period = period
        self._previous: float | None = None

    def read(self, angle: float) -> tuple[float, float]:
        """Return the measured angle (rad) and velocity (rad/s); the velocity of the first reading is 0."""
        measured = math.floor(angle / self._resolution) * self._resolution
        velocity = 0.0 if self._previous is None else (measured - self._previous) / self._period
        self._previous = measured
        return measured, velocity


class Drives:
    """The two motor drives: a delay in whole samples, a torque step and a torque limit."""

    def __init__(self, options: PlantOptions) -> None:
        """Make drives at zero torque."""
        self._options = options
        self._waiting = deque([(0.0, 0.0)] * options.delay_samples)

    def apply(self, command: tuple[float, float]) -> tuple[float, float]:
        """Take a new torque command (Nm) and return the torques (Nm) that act now.

        Raises:
            ValueError: a torque is not a number; limiting it would turn it into the limit.
        """
        if math.isnan(command[0]) or math.isnan(command[1]):
            raise ValueError(f"torque command {command} Nm is not a number")
        self._waiting.append(command)
        tau1, tau2 = self._waiting.popleft()
        return self._shape(tau1), self._shape(tau2)

    def _shape(self, torque: float) -> float:
        quantum, limit = self._options.torque_quantum, self._options.torque_limit
        if quantum > 0.0:
            torque = round(torque / quantum) * quantum
        if limit is not None:
            torque = max(-limit, min(limit, torque))
        return torque


class ImuReading(NamedTuple):
    """An IMU sample in the IMU's own frame: linear acceleration (m/s^2) and angular velocity (rad/s)."""

    acceleration: tuple[float, float, float]
    angular_velocity: tuple[float, float, float]


class Imu:
    """A three-axis accelerometer and gyroscope at the platform, fixed to the distal link of leg 2."""

    def __init__(self, options: ImuOptions, seed: int) -> None:
        """Make an IMU with a random stream of its own."""
        self._options = options
        self._random = np.random.default_rng([seed, 1])

    def read(self, acceleration: tuple[float, float], rate: float) -> ImuReading:
        """Return the reading for an exact acceleration in the distal link's frame (m/s^2) and its rate (rad/s)."""
        noise = self._random.normal(0.0, self._options.noise, 3) if self._options.noise > 0.0 else (0.0, 0.0, 0.0)
        return ImuReading(
            (
                acceleration[0] + float(noise[0]),
                acceleration[1] + float(noise[1]),
                self._options.gravity + float(noise[2]),
            ),
            (0.0, 0.0, rate),
        )
