# SPDX-License-Identifier: Apache-2.0
"""Simulated sensors of one value that follows from the joints' angles.

They are an encoder on a passive joint, and a sensor from another package. numba compiles `passive_reading`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from fivebar_description.extra_sensor import MountedSensor
from fivebar_description.interface import EXTRA_NAME, EXTRA_READINGS, PASSIVE_STATES, Topic
from fivebar_description.parameters import FiveBar
from fivebar_description.sensors import LateSensor, PassiveEncoder
from fivebar_sim.effects.encoders import EncoderDisc, seen
from fivebar_sim.sensors import EXTRA_LOSSES, PASSIVE_LOSSES, ReadingQueue, counted

PASSIVE_STREAM = 5
"""Stream of the random number that is the phase of the passive encoder's eccentricity."""

EXTRA_STREAM = 8
"""Stream of the noise of a sensor from another package."""


class PassiveNumbers(NamedTuple):
    """The encoder as numbers: its disc, and the angle of a count (rad), 0 for an exact one."""

    disc: EncoderDisc
    resolution: float


def passive_numbers(settings: PassiveEncoder, seed: int) -> PassiveNumbers:
    """Return the numbers of an encoder; the seed is that of its phase."""
    phase = float(np.random.default_rng([seed, PASSIVE_STREAM]).uniform(0.0, 2.0 * math.pi))
    resolution = 2.0 * math.pi / settings.counts if settings.counts else 0.0
    return PassiveNumbers(EncoderDisc(float(settings.zero), float(settings.eccentricity), phase), resolution)


def passive_reading(numbers: PassiveNumbers, angle: float) -> float:
    """Return the reading (rad) of an angle (rad)."""
    reading = seen(numbers.disc, angle, 0.0).angle
    return counted(reading, numbers.resolution) if numbers.resolution > 0.0 else reading


def extra_noise(seed: int) -> np.random.Generator:
    """Return the random stream of the noise of a sensor from another package, a number for each sample."""
    return np.random.default_rng([seed, EXTRA_STREAM])


class ScalarReading(NamedTuple):
    """A reading: the sensor's name, its topic, the sample at which it was made, and the value in the sensor's unit."""

    name: str
    topic: Topic
    made: int
    value: float


class ScalarSensor:
    """A simulated sensor of one value; call `arrived` once per sample."""

    def __init__(
        self,
        name: str,
        topic: Topic,
        settings: LateSensor,
        losses: int,
        read: Callable[[Sequence[float]], float],
        rate_hz: int,
        seed: int,
    ) -> None:
        """Begin a run; `read` returns the reading of four exact joint angles (rad)."""
        self.topic = topic
        self._name, self._read = name, read
        self._queue: ReadingQueue[float] = ReadingQueue(settings, rate_hz, seed, losses)

    def arrived(self, sample: int, angles: Sequence[float]) -> list[ScalarReading]:
        """Return what arrives with a sample, given the exact joint angles (rad) at it."""
        arrived = self._queue.arrived(sample, self._read(angles))
        return [ScalarReading(self._name, self.topic, number, value) for number, value in arrived]


def scalar_sensors(
    passive: PassiveEncoder, extra: MountedSensor | None, robot: FiveBar, rate_hz: int, seed: int
) -> list[ScalarSensor]:
    """Return the sensors of a robot at the beginning of a run.

    Args:
        passive: the encoder on a passive joint; its leg is 0 for none.
        extra: a sensor from another package, None for none.
        robot: with its actual parameters.
        rate_hz: samples per second.
        seed: of losses, noise, and of the encoder's phase.
    """
    sensors = []
    if passive.leg:
        encoder, place = passive_numbers(passive, seed), passive.place
        sensors.append(
            ScalarSensor(
                passive.joint,
                PASSIVE_STATES,
                passive,
                PASSIVE_LOSSES,
                lambda angles: passive_reading(encoder, angles[place]),
                rate_hz,
                seed,
            )
        )
    if extra is not None:
        numbers, noise, read = extra.numbers, extra_noise(seed), extra.kind.read
        sensors.append(
            ScalarSensor(
                EXTRA_NAME,
                EXTRA_READINGS,
                extra,
                EXTRA_LOSSES,
                lambda angles: read(numbers, robot, *angles, float(noise.standard_normal())),
                rate_hz,
                seed,
            )
        )
    return sensors
