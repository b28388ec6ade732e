# SPDX-License-Identifier: Apache-2.0
"""The filters of the identification: one response for all derivatives, torques aligned with what they bring about."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.identification.smoothing import differentiator, filtered, filtered_torque, parallel_filter

Array = NDArray[np.float64]

RATE = 500.0
TIME = np.arange(3000) / RATE


def closed_form_response(cutoff: float, frequency: float) -> float:
    """e^-x (1 + x + ... + x^4 / 24), with x scaled so that it is one half at the cut-off."""
    x = 4.670909 * (frequency / cutoff) ** 2
    return math.exp(-x) * (1.0 + x + x**2 / 2.0 + x**3 / 6.0 + x**4 / 24.0)


@pytest.mark.parametrize("cutoff", [5.0, 20.0, 50.0])
@pytest.mark.parametrize("part", [0.1, 0.4, 1.0, 1.5])
def test_angle_and_derivatives_pass_with_one_response_and_no_phase(cutoff: float, part: float) -> None:
    pulsation = 2.0 * math.pi * part * cutoff
    response = closed_form_response(cutoff, part * cutoff)
    wave, quarter = np.sin(pulsation * TIME + 0.4), np.cos(pulsation * TIME + 0.4)
    taps = differentiator(cutoff, RATE)
    expectations = ((taps.angle, wave), (taps.rate, pulsation * quarter), (taps.acceleration, -(pulsation**2) * wave))
    for kernel, exact in expectations:
        found = filtered(wave, kernel)
        inside = np.isfinite(found)
        assert inside.sum() == len(wave) - len(kernel) + 1
        assert np.allclose(found[inside], response * exact[inside], atol=1e-5 * np.max(np.abs(exact)), rtol=0.0)


def test_the_filter_is_flat_to_a_thousandth_up_to_two_fifths_of_its_cutoff() -> None:
    assert closed_form_response(20.0, 20.0) == pytest.approx(0.5, abs=1e-5)
    assert 1.0 - closed_form_response(20.0, 8.0) < 2e-3
    assert 1.0 - closed_form_response(20.0, 5.0) < 2e-5


@pytest.mark.parametrize("cutoff", [8.0, 25.0, 50.0])
def test_filtered_acceleration_is_the_filtered_torque_of_an_inertia(cutoff: float) -> None:
    """Random torques, each held over the period before its sample, on 1 kg m^2: motion integrated in closed form.

    A torque that were taken half a period too early or too late would be off by a percent and more.
    """
    random = np.random.default_rng(3)
    torque = np.convolve(random.normal(size=len(TIME)), np.ones(9) / 9.0, mode="same")
    period = 1.0 / RATE
    speed = np.cumsum(torque * period)
    before = np.concatenate([[0.0], speed[:-1]])
    angle = np.cumsum(period * before + 0.5 * period**2 * torque)
    taps = differentiator(cutoff, RATE)
    acceleration = filtered(angle, taps.acceleration)
    seen = filtered_torque(torque, taps.torque)
    inside = np.isfinite(acceleration) & np.isfinite(seen)
    assert inside.sum() == len(TIME) - len(taps.angle) + 1
    scale = np.max(np.abs(acceleration[inside]))
    assert np.max(np.abs(seen - acceleration)[inside]) < 1e-4 * scale
    late = np.roll(seen, 1)
    assert np.max(np.abs(late - acceleration)[inside][1:]) > 1e-2 * scale


def test_a_constant_angle_has_no_derivatives() -> None:
    taps = differentiator(50.0, RATE)
    assert np.sum(taps.angle) == pytest.approx(1.0, abs=1e-7)
    assert abs(np.sum(taps.rate)) < 1e-10
    assert abs(np.sum(taps.acceleration)) < 1e-8
    assert np.sum(taps.torque) == pytest.approx(1.0, abs=1e-7)


def test_a_missing_sample_spoils_its_surroundings_only() -> None:
    taps = parallel_filter(10.0, RATE)
    reach = len(taps) // 2
    values = np.ones(1000)
    values[500] = math.nan
    spoilt = np.flatnonzero(~np.isfinite(filtered(values, taps)))
    expected = [*range(reach), *range(500 - reach, 501 + reach), *range(1000 - reach, 1000)]
    assert spoilt.tolist() == expected
    kernel = differentiator(50.0, RATE).torque
    half = len(kernel) // 2
    lost = np.flatnonzero(~np.isfinite(filtered_torque(values, kernel)))
    # the torque of sample 500 acted in the period before it
    assert [k for k in lost.tolist() if 200 < k < 800] == list(range(500 - half, 500 + half))


def test_the_parallel_filter_passes_half_at_its_cutoff() -> None:
    wave = np.sin(2.0 * math.pi * 10.0 * TIME)
    found = filtered(wave, parallel_filter(10.0, RATE))
    inside = np.isfinite(found)
    assert np.allclose(found[inside], 0.5 * wave[inside], atol=1e-3)


def test_a_record_shorter_than_the_filter_is_all_unknown() -> None:
    taps = differentiator(5.0, RATE)
    assert np.isnan(filtered(np.ones(100), taps.angle)).all()
    assert np.isnan(filtered_torque(np.ones(100), taps.torque)).all()
