# SPDX-License-Identifier: Apache-2.0
"""The cut-offs follow from the encoder's resolution, the sampling rate and the motion."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from fivebar_control.identification.cutoff import choose_cutoffs, encoder_resolution
from fivebar_control.identification.smoothing import differentiator, filtered

Array = NDArray[np.float64]

RATE = 500.0
TIME = np.arange(4000) / RATE


def swept(highest: float) -> Array:
    """Both motors' angles (rad): sines at fractions of a highest frequency (Hz)."""
    waves = [np.sin(2.0 * math.pi * part * highest * TIME + part) for part in (0.2, 0.5, 1.0)]
    return np.stack([0.4 * waves[0] + 0.2 * waves[2], 0.5 * waves[1] - 0.1 * waves[2]], axis=1)


def counted(angles: Array, counts: int) -> Array:
    resolution = 2.0 * math.pi / counts
    return np.floor(angles / resolution) * resolution


@given(counts=st.integers(1000, 200_000), offset=st.floats(-3.0, 3.0))
def test_the_resolution_is_found_whatever_the_homing_offset(counts: int, offset: float) -> None:
    found = encoder_resolution(counted(swept(3.0), counts) + offset)
    assert found == pytest.approx(2.0 * math.pi / counts, rel=1e-6)


def test_readings_that_are_no_counts_have_no_resolution() -> None:
    assert encoder_resolution(swept(3.0)) == 0.0
    assert encoder_resolution(np.zeros((100, 2))) == 0.0
    assert encoder_resolution(np.random.default_rng(1).normal(size=(500, 2))) == 0.0


def test_a_coarser_encoder_lowers_the_cutoff() -> None:
    """Accelerations that change their sign at once have a spectrum that falls off slowly."""
    speed = np.cumsum(np.sign(np.sin(2.0 * math.pi * 1.3 * TIME)))
    angle = 20.0 / RATE**2 * np.cumsum(speed)
    angles = np.stack([angle, -angle], axis=1)
    chosen = [choose_cutoffs(counted(angles, counts), RATE).derivative_hz for counts in (400_000, 20_000, 1_000)]
    assert chosen[0] == 0.1 * RATE
    assert chosen[0] > chosen[1] > chosen[2] >= 6.0


def test_exact_readings_get_the_highest_cutoff() -> None:
    """A motion without a spectrum at high frequencies, every angle to the last digit."""
    cutoffs = choose_cutoffs(swept(3.0), RATE)
    assert (cutoffs.resolution, cutoffs.derivative_hz) == (0.0, 0.1 * RATE)


@pytest.mark.parametrize(("highest", "counts"), [(2.0, 20_000), (5.0, 20_000), (5.0, 2_000)])
def test_the_noise_that_is_left_is_a_hundredth_of_the_motion(highest: float, counts: int) -> None:
    """Measured: what the filter makes of the rounding alone, against the accelerations themselves."""
    angles = swept(highest)
    cutoffs = choose_cutoffs(counted(angles, counts), RATE)
    kernel = differentiator(cutoffs.derivative_hz, RATE).acceleration
    rounding = counted(angles, counts) - angles
    noise = np.concatenate([filtered(rounding[:, motor], kernel) for motor in range(2)])
    accelerations = np.diff(angles, 2, axis=0) * RATE**2
    share = np.sqrt(np.nanmean(noise**2) / np.mean(accelerations**2))
    assert 0.005 < share < 0.02
    assert cutoffs.acceleration == pytest.approx(np.sqrt(np.mean(accelerations**2)), rel=0.1)


def test_the_parallel_filter_stays_where_the_differentiator_is_flat() -> None:
    cutoffs = choose_cutoffs(counted(swept(4.0), 20_000), RATE)
    wave = np.sin(2.0 * math.pi * cutoffs.parallel_hz * TIME)
    passed = filtered(wave, differentiator(cutoffs.derivative_hz, RATE).angle)
    assert np.nanmax(np.abs(passed - wave)) < 2e-3


def test_the_noise_of_readings_that_are_no_counts_is_measured() -> None:
    noise = 3e-5 * np.random.default_rng(2).normal(size=(len(TIME), 2))
    assert choose_cutoffs(swept(3.0) + noise, RATE).noise == pytest.approx(3e-5, rel=0.1)


def test_the_noise_of_counts_is_that_of_rounding() -> None:
    cutoffs = choose_cutoffs(counted(swept(3.0), 20_000), RATE)
    assert cutoffs.noise == pytest.approx(2.0 * math.pi / 20_000 / math.sqrt(12.0), rel=1e-6)
