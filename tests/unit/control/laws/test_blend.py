# SPDX-License-Identifier: Apache-2.0
"""The blending weight and the blend."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.laws.blend import blend, blending_weight, forecast_width
from fivebar_control.laws.torque import UNDEFINED, Torque

KAPPA = st.floats(0.0, 1.0)
EPSILON = st.floats(1e-4, 0.5)


@pytest.mark.parametrize("epsilon", [0.01, 0.05, 0.3])
def test_weight_at_the_ends_and_in_the_middle_of_the_ramp(epsilon: float) -> None:
    assert blending_weight(0.0, epsilon) == 1.0
    assert blending_weight(0.5 * epsilon, epsilon) == 1.0
    assert blending_weight(epsilon, epsilon) == 1.0
    assert blending_weight(1.25 * epsilon, epsilon) == pytest.approx(0.75, abs=1e-15)
    assert blending_weight(1.5 * epsilon, epsilon) == pytest.approx(0.5, abs=1e-15)
    assert blending_weight(2.0 * epsilon, epsilon) == 0.0
    assert blending_weight(1.0, epsilon) == 0.0


@given(one=KAPPA, other=KAPPA, epsilon=EPSILON)
def test_weight_is_continuous_falls_with_kappa_and_stays_in_its_range(one: float, other: float, epsilon: float) -> None:
    low, high = sorted((one, other))
    near, far = blending_weight(low, epsilon), blending_weight(high, epsilon)
    assert 0.0 <= far <= near <= 1.0
    assert near - far <= (high - low) / epsilon + 1e-12


@given(rate=st.floats(0.1, 20.0), share=st.floats(0.0, 2.0), kappa=KAPPA)
def test_a_robot_that_moves_as_planned_has_the_planned_zone_and_a_slower_one_a_narrower(
    rate: float, share: float, kappa: float
) -> None:
    zone_time = 0.04
    planned = 0.5 * zone_time * rate
    assert forecast_width(rate, zone_time, planned) == pytest.approx(planned)
    width = forecast_width(share * rate, zone_time, planned)
    slower, wanted = blending_weight(kappa, width), blending_weight(kappa, planned)
    assert slower <= wanted if share <= 1.0 else slower >= wanted
    # sigma is 1 as long as a coasting platform is within half of the time from the locus
    if width > 0.0 and kappa < width:
        assert kappa / (share * rate) <= 0.5 * zone_time + 1e-12
        assert slower == 1.0
    assert forecast_width(rate, zone_time, 0.0) == 0.0


def test_without_a_planned_crossing_only_the_locus_itself_switches() -> None:
    assert blending_weight(0.0, 0.0) == 1.0
    assert blending_weight(5e-324, 0.0) == 0.0
    assert blending_weight(0.2, 0.0) == 0.0


def test_an_unknown_kappa_gives_no_weight_that_a_blend_could_use() -> None:
    weight = blending_weight(math.nan, 0.05)
    assert math.isnan(weight)
    assert all(math.isnan(value) for value in blend(weight, Torque(1.0, 1.0), Torque(2.0, 2.0)))


def test_blend_mixes_linearly() -> None:
    away, on_locus = Torque(1.0, -2.0), Torque(3.0, 6.0)
    assert blend(0.25, away, on_locus) == pytest.approx((1.5, 0.0), abs=1e-15)
    assert blend(0.75, away, on_locus) == pytest.approx((2.5, 4.0), abs=1e-15)
    assert blend(0.0, away, on_locus) == away
    assert blend(1.0, away, on_locus) == on_locus


def test_a_candidate_without_weight_may_be_undefined() -> None:
    """1 * u + 0 * NaN would be NaN."""
    good = Torque(0.5, -0.5)
    assert blend(0.0, good, UNDEFINED) == good
    assert blend(1.0, UNDEFINED, good) == good


@pytest.mark.parametrize("sigma", [1e-300, 0.5, 1.0 - 1e-16])
def test_a_candidate_with_weight_may_not(sigma: float) -> None:
    good = Torque(0.5, -0.5)
    for torque in (blend(sigma, good, UNDEFINED), blend(sigma, UNDEFINED, good)):
        assert all(math.isnan(value) for value in torque)


def test_an_unknown_kappa_where_no_crossing_is_planned_is_as_unknown() -> None:
    assert math.isnan(blending_weight(math.nan, 0.0))
