"""Sensors whose readings do not come with every sample: how often they read, and how late their readings arrive."""

from __future__ import annotations

from typing import Annotated, NamedTuple, Protocol

from fivebar_description.settings import Setting

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
