# SPDX-License-Identifier: Apache-2.0
"""The rest-to-rest polynomials: of fifth order (4.3 to 4.6), and of seventh order without a jerk."""

from __future__ import annotations

from collections.abc import Callable

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.trajectory.time_scaling import rest_to_rest, rest_to_rest_without_jerk

INSIDE = st.floats(0.001, 0.999)
both = pytest.mark.parametrize("law", [rest_to_rest, rest_to_rest_without_jerk])

Law = Callable[[float], tuple[float, float, float]]


@both
def test_it_rests_at_both_ends(law: Law) -> None:
    assert law(0.0) == (0.0, 0.0, 0.0)
    assert law(1.0) == (1.0, 0.0, 0.0)
    h = 1e-6
    assert law(h) == pytest.approx((0.0, 0.0, 0.0), abs=1e-4)
    assert law(1.0 - h) == pytest.approx((1.0, 0.0, 0.0), abs=1e-4)


@both
@pytest.mark.parametrize("u", [-1.0, -1e-9, 1.0 + 1e-9, 7.0])
def test_it_rests_outside(u: float, law: Law) -> None:
    assert law(u) == (0.0 if u < 0.0 else 1.0, 0.0, 0.0)


def test_half_way_it_is_fastest() -> None:
    assert rest_to_rest(0.5) == pytest.approx((0.5, 1.875, 0.0), abs=1e-15)
    assert max(rest_to_rest(step / 100.0)[1] for step in range(101)) == 1.875


def test_the_seventh_order_starts_without_a_jerk() -> None:
    """Near its ends its acceleration goes with u^2, that of the fifth order with u."""
    for law, power in ((rest_to_rest, 1), (rest_to_rest_without_jerk, 2)):
        assert law(1e-5)[2] / law(1e-4)[2] == pytest.approx(0.1**power, rel=1e-3)


@both
@given(u=INSIDE)
def test_rates_are_derivatives(u: float, law: Law) -> None:
    h = 1e-5
    s, ds, dds = law(u)
    (before, before_rate, _), (after, after_rate, _) = law(u - h), law(u + h)
    assert ds == pytest.approx((after - before) / (2.0 * h), abs=1e-8)
    assert dds == pytest.approx((after_rate - before_rate) / (2.0 * h), abs=1e-7)
    assert before < s < after


@both
@given(u=INSIDE)
def test_it_is_point_symmetric_about_half_way(u: float, law: Law) -> None:
    s, ds, dds = law(u)
    mirrored = law(1.0 - u)
    assert mirrored == pytest.approx((1.0 - s, ds, -dds), abs=1e-12)
