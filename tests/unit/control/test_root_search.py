# SPDX-License-Identifier: Apache-2.0
"""Zeros and minima, against those of SciPy to the last bit."""

from __future__ import annotations

import math
from collections.abc import Callable

import pytest
from scipy.optimize import brentq, minimize_scalar

from fivebar_control.root_search import minimum_between, zero_between

FUNCTIONS: dict[str, Callable[[float], float]] = {
    "line": lambda x: 3.0 * x - 1.0,
    "cubic": lambda x: (x - 0.3) * (x + 2.0) ** 2,
    "kink": lambda x: abs(x - 0.4) - 0.1,
    "steep": lambda x: math.atan(50.0 * (x - 0.7)) + 1e-3,
    "wavy": lambda x: math.sin(9.0 * x) + 0.5 * x,
    "steps": lambda x: float(round(7.0 * x - 3.2)),
    "exponential": lambda x: math.exp(4.0 * x) - 7.0,
}


@pytest.mark.parametrize("tolerance", [1e-15, 2e-12, 1e-6])
@pytest.mark.parametrize("name", FUNCTIONS)
def test_zeros_and_minima_are_those_of_scipy(name: str, tolerance: float) -> None:
    function, found = FUNCTIONS[name], 0
    for number in range(20):
        low, high = -0.05 * number, 0.45 + 0.03 * number
        if (function(low) < 0.0) != (function(high) < 0.0):
            assert zero_between(function, low, high, tolerance) == brentq(function, low, high, xtol=tolerance)
            found += 1
        least = minimize_scalar(function, bounds=(low, high), method="bounded", options={"xatol": tolerance})
        assert minimum_between(function, low, high, tolerance) == (least.x, least.fun)
    assert found > 0


def test_a_zero_at_an_end_is_found_at_once() -> None:
    assert zero_between(lambda x: x, 0.0, 1.0) == 0.0
    assert zero_between(lambda x: x - 1.0, 0.0, 1.0) == 1.0


@pytest.mark.parametrize("function", [lambda x: x * x + 1.0, lambda x: math.nan if x > 0.5 else -1.0])
def test_what_has_no_zero_is_refused(function: Callable[[float], float]) -> None:
    with pytest.raises(ValueError, match=r"^a zero"):
        zero_between(function, 0.0, 1.0)
