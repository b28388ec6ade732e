# SPDX-License-Identifier: Apache-2.0
"""Faults of the gyroscope: what its readings, their arrival and its clock may have besides noise and bias."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_description.imu import ImuSettings
from fivebar_description.interface import NANOSECONDS, START_STAMP_NS, late_stamp_ns
from fivebar_description.settings import Setting
from fivebar_sim.effects.timing import MOMENT, RANGE, drawn, moment_setting

STREAM = 7
"""Stream of the random number from which the clock's jitter is made."""


class GyroscopeFaults(NamedTuple):
    """How the simulated gyroscope differs from what `imu` says of it. Its noise, bias and clock's offset are there.

    Each time begins with the first sample at or after it.
    """

    scale: Annotated[
        float,
        Setting("Relative error of its sensitivity; typical: 0.005 to 0.03.", at_least=-1.0, at_most=1.0),
    ] = 0.0
    misalignment: Annotated[
        float,
        Setting(
            "Angle between its axis and that of the link; typical: 0.01 to 0.05.",
            "rad",
            at_least=0.0,
            at_most=math.pi,
        ),
    ] = 0.0
    bias_jump: Annotated[
        float, Setting("By how much its bias jumps; 0.02 to 0.5 after a blow.", "rad/s", at_least=-35.0, at_most=35.0)
    ] = 0.0
    bias_time: Annotated[float, moment_setting("When its bias jumps, from sample 0.")] = 0.0
    frozen_from: Annotated[float, moment_setting("When it begins to repeat its reading, from sample 0.")] = 0.0
    frozen_length: Annotated[float, moment_setting("How long it repeats it, 0 for never.")] = 0.0
    missing_from: Annotated[float, moment_setting("When its readings begin to be missing, from sample 0.")] = 0.0
    missing_length: Annotated[
        float, moment_setting("How long they are missing, 0 for never; typical: 0.03 to 0.3 for a driver that stalls.")
    ] = 0.0
    clock_drift: Annotated[
        float,
        Setting("Time by which its clock gains in each second; typical: 5e-5.", "s/s", at_least=-0.1, at_most=0.1),
    ] = 0.0
    clock_jitter: Annotated[
        float,
        Setting(
            "Largest error of a single stamp, uniformly drawn, plus or minus; typical: 0.001.",
            "s",
            at_least=0.0,
            at_most=0.1,
        ),
    ] = 0.0


NO_FAULTS = GyroscopeFaults()


class SampleSpan(NamedTuple):
    """The samples from `first` to before `end`."""

    first: int
    end: int

    def has(self, sample: int) -> bool:
        """Return whether a sample is among them."""
        return self.first <= sample < self.end


def first_sample(time: float, rate_hz: int) -> int:
    """Return the first sample at or after a time (s)."""
    return math.ceil((time - MOMENT) * rate_hz)


def span(begin: float, length: float, rate_hz: int) -> SampleSpan:
    """Return the samples of a length (s) from a time (s) on."""
    return SampleSpan(first_sample(begin, rate_hz), first_sample(begin + length, rate_hz))


def frozen_samples(faults: GyroscopeFaults, rate_hz: int) -> SampleSpan:
    """Return the samples whose readings repeat the one before; never sample 0, which has none before."""
    samples = span(faults.frozen_from, faults.frozen_length, rate_hz)
    return SampleSpan(max(1, samples.first), samples.end)


def missing_samples(faults: GyroscopeFaults, rate_hz: int) -> SampleSpan:
    """Return the samples whose readings never arrive."""
    return span(faults.missing_from, faults.missing_length, rate_hz)


def gain(faults: GyroscopeFaults) -> float:
    """Return how much it reads of a rate."""
    return (1.0 + faults.scale) * math.cos(faults.misalignment)


def jump(faults: GyroscopeFaults, rate_hz: int, sample: int) -> float:
    """Return by how much its bias has jumped at a sample (rad/s)."""
    return faults.bias_jump if sample >= first_sample(faults.bias_time, rate_hz) else 0.0


def jumps(faults: GyroscopeFaults, rate_hz: int, samples: int) -> NDArray[np.float64]:
    """Return the same for samples 0, 1, ..., [samples]."""
    return np.where(np.arange(samples) >= first_sample(faults.bias_time, rate_hz), faults.bias_jump, 0.0)


class ImuClock:
    """The clock of a simulated IMU."""

    def __init__(self, settings: ImuSettings, faults: GyroscopeFaults, rate_hz: int, seed: int) -> None:
        """Make a clock; the seed is that of its jitter."""
        self._offset, self._drift, self._jitter = settings.clock_offset, faults.clock_drift, faults.clock_jitter
        self._rate_hz = rate_hz
        self._key = int(np.random.default_rng([seed, STREAM]).integers(0, RANGE))

    def offset(self, sample: int) -> float:
        """Return by how much the stamp of the reading of a sample is late (s)."""
        offset = self._offset + self._drift * (sample / self._rate_hz)
        return offset + self._jitter * (2.0 * drawn(self._key, sample) - 1.0) if self._jitter > 0.0 else offset

    def stamp_ns(self, sample: int, epoch_ns: int = START_STAMP_NS) -> int:
        """Return the stamp (ns) of the reading of a sample."""
        return late_stamp_ns(sample, self._rate_hz, self.offset(sample), epoch_ns)

    def moments(self, samples: int) -> NDArray[np.float64]:
        """Return the moments that the stamps of the readings of samples 0, 1, ... name, in samples, [samples]."""
        if self._jitter > 0.0:
            offsets = np.array([self.offset(sample) for sample in range(samples)])
        else:
            offsets = self._offset + self._drift * (np.arange(samples) / self._rate_hz)
        period = NANOSECONDS // self._rate_hz
        # whole numbers of nanoseconds below 2^53, whose sums are exact
        moments: NDArray[np.float64] = (np.arange(samples) * period + np.rint(offsets * NANOSECONDS)) / period
        return moments
