"""Sampling, latency and loss of the readings of a sensor that does not come with every sample."""

from __future__ import annotations

from collections import deque
from typing import Any, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from fivebar_description.imu import ImuSettings
from fivebar_description.readings import LateSensor
from fivebar_sim.effects.gyroscope import GyroscopeFaults, SampleSpan, missing_samples

T = TypeVar("T")

IMU_LOSSES, PASSIVE_LOSSES = 3, 4
"""Random streams of the lost readings of each sensor."""

NONE = SampleSpan(0, 0)


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
        self._random = loss_stream(seed, losses)
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


def loss_stream(seed: int, losses: int = IMU_LOSSES) -> np.random.Generator:
    """Return a random stream of lost readings: one number for each sample, below the lost fraction for a loss."""
    return np.random.default_rng([seed, losses])


def lost_readings(settings: LateSensor, seed: int, samples: int, losses: int = IMU_LOSSES) -> NDArray[np.bool_]:
    """Return which of the readings of samples 0, 1, ... never arrive, [samples]."""
    lost: NDArray[np.bool_] = loss_stream(seed, losses).random(samples) < settings.lost
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
