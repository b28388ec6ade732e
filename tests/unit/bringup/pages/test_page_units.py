# SPDX-License-Identifier: Apache-2.0
"""Errors as they are told: an error is within what is said of it."""

from __future__ import annotations

import math
from decimal import Decimal

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_bringup.units import PREFIXES, error_of
from fivebar_description.rounding import in_millimetres

ERRORS = st.floats(min_value=1e-15, max_value=10.0)
FACTORS = {prefix: Decimal(repr(factor)) for factor, prefix in PREFIXES}


@given(ERRORS)
def test_an_error_in_millimetres_is_rounded_up_and_by_little(error: float) -> None:
    number, unit = in_millimetres(error).split()
    told, true = Decimal(number), Decimal(repr(error)) * 1000
    assert unit == "mm"
    assert true <= told < true + Decimal("0.01")
    if true < Decimal("0.01"):
        assert told <= 2 * true


@given(ERRORS, st.sampled_from(["m", "rad"]))
def test_an_error_with_a_prefix_is_rounded_up_and_by_little(error: float, unit: str) -> None:
    number, prefixed = error_of(error, unit).split()
    assert prefixed.endswith(unit)
    told, true = Decimal(number) * FACTORS[prefixed.removesuffix(unit)], Decimal(repr(error))
    assert true <= told <= true * Decimal("1.01")


@pytest.mark.parametrize(
    ("error", "millimetres", "prefixed"),
    [
        (3.35e-5, "0.04 mm", "33.5 µm"),
        (0.027651, "27.66 mm", "27.7 mm"),
        (0.0009991, "1.00 mm", "1.00 mm"),
        (0.002, "2.00 mm", "2.00 mm"),
        (9.6e-6, "0.01 mm", "9.60 µm"),
        (1.2e-13, "2e-10 mm", "1.20e-13 m"),
        (0.0, "0.00 mm", "0 m"),
        (None, "–", "–"),
        (math.inf, "inf mm", "inf Mm"),
        (math.nan, "nan mm", "nan m"),
    ],
)
def test_errors_as_they_are_told(error: float | None, millimetres: str, prefixed: str) -> None:
    assert (in_millimetres(error), error_of(error, "m")) == (millimetres, prefixed)
