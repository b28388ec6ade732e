# SPDX-License-Identifier: Apache-2.0
"""Sensors whose readings do not come with every sample: how often they read, how late readings arrive, what is known.

The encoder on a passive joint is one of them; the IMU and the camera have modules of their own.
"""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple, Protocol

from fivebar_description.interface import JOINTS
from fivebar_description.settings import Section, Setting
from fivebar_description.shared_settings import EncoderCounts

LONGEST_LATENCY = 0.02
"""Age (s) beyond which the estimator discards a reading."""

LARGEST_OFFSET = 0.2
"""Largest offset (s) of a sensor's clock: readings whose stamps are farther off are of another run."""

ReadingRate = Annotated[
    int,
    Setting("Readings per second, rounded to every n-th sample; 0 for every sample.", "Hz", at_least=0, at_most=10_000),
]
Latency = Annotated[
    float,
    Setting(
        "Time from a reading to its arrival, rounded to whole samples; 0.001 to 0.01 for I2C and USB.",
        "s",
        at_least=0.0,
        at_most=LONGEST_LATENCY,
    ),
]
LostReadings = Annotated[float, Setting("Fraction of the readings that never arrive.", at_least=0.0, at_most=1.0)]


class ReadingSchedule(NamedTuple):
    """A reading is made at every n-th sample, and arrives with the motor readings of a later one.

    Attributes:
        every: samples from one reading to the next.
        latency: samples from a reading to its arrival.
    """

    every: int
    latency: int


def schedule_of(reading_rate: int, latency: float, rate_hz: int) -> ReadingSchedule:
    """Return when readings are made (1/s, 0 for every sample) and arrive (s late), at a sampling rate (Hz)."""
    every = max(1, round(rate_hz / reading_rate)) if reading_rate else 1
    return ReadingSchedule(every, round(latency * rate_hz))


class LateSensor(Protocol):
    """Settings of a sensor with late readings."""

    @property
    def lost(self) -> float:
        """Fraction of the readings that never arrive."""

    def schedule(self, rate_hz: int) -> ReadingSchedule:
        """Return when readings are made and arrive, at a sampling rate (Hz)."""


class PassiveEncoder(NamedTuple):
    """An encoder on a passive joint, q12 or q22. Zero, eccentricity and losses concern the simulation only.

    How exactly its zero is known is `passive_zero` of the tolerances.
    """

    leg: Annotated[int, Setting("Leg whose passive joint has the encoder, 0 for none.", at_least=0, at_most=2)] = 0
    counts: EncoderCounts = 4096
    zero: Annotated[
        float,
        Setting(
            "Reading where the angle is 0; typical: 2e-3 by a jig, 1e-2 by eye.",
            "rad",
            at_least=-math.pi,
            at_most=math.pi,
        ),
    ] = 0.0
    eccentricity: Annotated[
        float,
        Setting(
            "Amplitude of the error once a turn: eccentricity over the disc's radius; typical: 1e-3.",
            "rad",
            at_least=0.0,
            at_most=0.1,
        ),
    ] = 0.0
    rate_hz: ReadingRate = 0
    latency: Latency = 0.0
    lost: LostReadings = 0.0

    @property
    def joint(self) -> str:
        """Name of the joint that has it."""
        return JOINTS[self.place]

    @property
    def place(self) -> int:
        """Place of that joint among all joints."""
        return 2 * self.leg - 1

    def schedule(self, rate_hz: int) -> ReadingSchedule:
        """Return when readings are made and arrive, at a sampling rate (Hz)."""
        return schedule_of(self.rate_hz, self.latency, rate_hz)


NO_ENCODER = PassiveEncoder()


class Sensors(NamedTuple):
    """Section `sensors` of a scenario: what the estimator has besides the motors' encoders and the IMU."""

    passive_encoder: Section[PassiveEncoder] = NO_ENCODER


class KnownSensors(NamedTuple):
    """Constant errors of sensors that are known, and that the estimator removes."""

    imu_clock: Annotated[
        float,
        Setting("Time by which the stamps of the IMU's clock are late.", "s", at_least=-1e3, at_most=1e3),
    ] = 0.0
    passive_zero: Annotated[
        float,
        Setting(
            "Reading of the passive joint's encoder where its angle is 0.", "rad", at_least=-math.pi, at_most=math.pi
        ),
    ] = 0.0

    def lagging(self, lag: float) -> KnownSensors:
        """Return the same for an IMU whose readings lag behind their stamps by a further time (s)."""
        return self._replace(imu_clock=self.imu_clock + lag)


NOTHING_KNOWN = KnownSensors()
