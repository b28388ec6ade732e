"""Encoders and drives: quantisation, limits and delay."""

from __future__ import annotations

import math
from collections import deque
from collections.abc import Collection

from fivebar_sim.effects.settings import PlantSettings


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
