# SPDX-License-Identifier: Apache-2.0
"""Choice of the cut-off frequencies: between the noise of the encoders and the bandwidth of the motion.

An encoder of resolution d rounds with a variance of d^2 / 12, spread evenly over all frequencies up to half the
sampling rate f_s: a density of d^2 / (6 f_s). Differentiated twice and cut off at f_c, that leaves an acceleration
noise whose variance is (2 pi)^4 f_c^5 / 5 times the density. The differentiating filter opens as far as that noise
stays a small part of the motion's own accelerations. The parallel filter, which both sides of the equations go through,
keeps the frequencies at which the differentiating filter is flat.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

NOISE_SHARE = 0.01
"""Acceleration noise that the differentiating filter leaves, as a part of the motion's accelerations (both rms)."""

LOWEST_HZ = 6.0
"""Lowest cut-off of the differentiating filter."""

HIGHEST_OF_RATE = 0.1
"""Its highest cut-off as a part of the sampling rate."""

ROUNDS = 10
"""Times that the motion's accelerations are measured below the cut-off that follows from them."""

FLAT_OF_CUTOFF = 0.4
"""Part of the differentiating filter's cut-off up to which it is flat to 0.1 %: cut-off of the parallel filter."""

COUNT_TOLERANCE = 1e-3
"""Largest departure of a step from a whole number of counts, in counts."""

SMALLEST_STEPS = (1, 2, 3, 4, 5)
"""Counts that the smallest step of a recording may have."""

LEAST_STEPS = 20
"""Fewest changes of the readings from which the resolution is inferred."""

MOST_COUNTS = 1e5
"""Largest step in counts: readings whose smallest step is finer than that are exact."""


class Cutoffs(NamedTuple):
    """The chosen cut-offs and what they follow from.

    Attributes:
        resolution: angle of an encoder's count (rad), 0 where the readings are not counts.
        noise: standard deviation of the angles' noise (rad).
        acceleration: of the motors, root mean square (rad/s^2).
        derivative_hz: of the differentiating filter.
        parallel_hz: of the parallel filter.
    """

    resolution: float
    noise: float
    acceleration: float
    derivative_hz: float
    parallel_hz: float

    def times(self, factor: float) -> Cutoffs:
        """Return the same with other frequencies of the filters."""
        return self._replace(derivative_hz=factor * self.derivative_hz, parallel_hz=factor * self.parallel_hz)


def encoder_resolution(angles: FloatArray) -> float:
    """Return the count (rad) of which all steps between readings [n, motors] are multiples, 0 where there is none."""
    steps = np.abs(np.diff(angles, axis=0))
    steps = steps[np.isfinite(steps) & (steps > 0.0)]
    if len(steps) < LEAST_STEPS:
        return 0.0
    for smallest in SMALLEST_STEPS:
        counts = steps * (smallest / np.min(steps))
        whole = np.round(counts)
        if np.max(counts) < MOST_COUNTS and np.max(np.abs(counts - whole)) < COUNT_TOLERANCE:
            return float(np.sum(steps) / np.sum(whole))
    return 0.0


def choose_cutoffs(angles: FloatArray, rate_hz: float) -> Cutoffs:
    """Return the cut-offs for readings [n, motors] (rad) without gaps.

    The noise of readings that are not counts follows from the upper half of the spectrum.
    """
    # imported here: it takes as long to load as the rest of a command that may not need it
    from scipy.signal import periodogram

    resolution = encoder_resolution(angles)
    frequency, density = periodogram(
        np.diff(angles, 2, axis=0) * rate_hz**2, rate_hz, window="hann", detrend=False, axis=0
    )
    # second differences pass a little less than the second derivative
    squared = (2.0 * rate_hz * np.sin(np.pi * frequency / rate_hz)) ** 4
    upper = frequency > 0.25 * rate_hz
    level = float(np.sum(density[upper].mean(axis=1)) / np.sum(squared[upper]))
    if resolution > 0.0:
        level = resolution**2 / 12.0 / (0.5 * rate_hz)
    motion = density.mean(axis=1) - level * squared
    highest = HIGHEST_OF_RATE * rate_hz
    derivative, variance = highest, 0.0
    for _ in range(ROUNDS):
        variance = max(float(np.sum(motion[frequency <= derivative])) * frequency[1], 0.0)
        derivative = min(max(_noisy_from(level, NOISE_SHARE**2 * variance), min(LOWEST_HZ, highest)), highest)
    return Cutoffs(
        resolution=resolution,
        noise=math.sqrt(level * 0.5 * rate_hz),
        acceleration=math.sqrt(variance),
        derivative_hz=derivative,
        parallel_hz=FLAT_OF_CUTOFF * derivative,
    )


def _noisy_from(level: float, variance: float) -> float:
    """Return the cut-off (Hz) at which noise of a density (rad^2/Hz) has a variance of acceleration (rad^2/s^4)."""
    return float((5.0 * variance / ((2.0 * math.pi) ** 4 * level)) ** 0.2) if level > 0.0 else math.inf
