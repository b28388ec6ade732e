# SPDX-License-Identifier: Apache-2.0
"""Values with their units as a person reads them."""

from __future__ import annotations

import math

from fivebar_description.rounding import exactly, rounded_up

PREFIXES = ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"), (1e-9, "n"))


def suitable_unit(largest: float | None, unit: str) -> tuple[float, str]:
    """Return a factor and the unit with prefix in which values of at most `largest` (in `unit`) read well."""
    for factor, prefix in PREFIXES:
        if largest and largest >= factor:
            return 1.0 / factor, prefix + unit
    return 1.0, unit


def engineering(value: float | None, unit: str) -> str:
    """Return a value for a person: three significant digits with a prefix that suits, or a dash."""
    if value is None:
        return "–"
    if value == 0.0:
        return f"0 {unit}"
    for factor, prefix in PREFIXES:
        if abs(value) >= 0.9995 * factor:
            return f"{_three_digits(value / factor)} {prefix}{unit}"
    return f"{value:.2g} {unit}"


def plain(value: float | None, unit: str) -> str:
    """Return a value for a person like :func:`engineering`, but with no prefix for small ones."""
    if value is None or value >= 999.5:
        return engineering(value, unit)
    return f"{value:#.3g}".rstrip(".") + f" {unit}"


def error_of(value: float | None, unit: str) -> str:
    """Return an error for a person like :func:`engineering`, but rounded up, so that it is within what is told."""
    if not value or not math.isfinite(value):
        return engineering(value, unit)
    exact = exactly(value)
    up = rounded_up(exact, 2 - exact.adjusted())
    for factor, prefix in PREFIXES:
        scaled = up / exactly(factor)
        if scaled >= 1:
            return f"{scaled:.{max(0, 2 - scaled.adjusted())}f} {prefix}{unit}"
    return f"{up:.2e} {unit}"


def _three_digits(value: float) -> str:
    decimals = 2 if abs(value) < 9.995 else 1 if abs(value) < 99.95 else 0
    return f"{value:.{decimals}f}"
