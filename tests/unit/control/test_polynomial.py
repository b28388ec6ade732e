"""The rest-to-rest polynomial (4.3 to 4.6)."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.trajectory.polynomial import rest_to_rest

INSIDE = st.floats(0.001, 0.999)


def test_it_rests_at_both_ends() -> None:
    assert rest_to_rest(0.0) == (0.0, 0.0, 0.0)
    assert rest_to_rest(1.0) == (1.0, 0.0, 0.0)
    h = 1e-6
    assert rest_to_rest(h) == pytest.approx((0.0, 0.0, 0.0), abs=1e-4)
    assert rest_to_rest(1.0 - h) == pytest.approx((1.0, 0.0, 0.0), abs=1e-4)


@pytest.mark.parametrize("u", [-1.0, -1e-9, 1.0 + 1e-9, 7.0])
def test_it_rests_outside(u: float) -> None:
    assert rest_to_rest(u) == (0.0 if u < 0.0 else 1.0, 0.0, 0.0)


def test_half_way_it_is_fastest() -> None:
    assert rest_to_rest(0.5) == pytest.approx((0.5, 1.875, 0.0), abs=1e-15)
    assert max(rest_to_rest(step / 100.0)[1] for step in range(101)) == 1.875


@given(u=INSIDE)
def test_rates_are_derivatives(u: float) -> None:
    h = 1e-5
    s, ds, dds = rest_to_rest(u)
    (before, before_rate, _), (after, after_rate, _) = rest_to_rest(u - h), rest_to_rest(u + h)
    assert ds == pytest.approx((after - before) / (2.0 * h), abs=1e-8)
    assert dds == pytest.approx((after_rate - before_rate) / (2.0 * h), abs=1e-7)
    assert before < s < after


@given(u=INSIDE)
def test_it_is_point_symmetric_about_half_way(u: float) -> None:
    s, ds, dds = rest_to_rest(u)
    mirrored = rest_to_rest(1.0 - u)
    assert mirrored == pytest.approx((1.0 - s, ds, -dds), abs=1e-12)
