# SPDX-License-Identifier: Apache-2.0
"""Errors as a person reads them: rounded up, so that what is measured is within what is told."""

from __future__ import annotations

import math
from decimal import ROUND_CEILING, Decimal


def in_millimetres(distance: float | None, decimals: int = 2) -> str:
    """Return an error (m) in mm, rounded up to so many decimals, a smaller one to its first digit, or a dash."""
    if distance is None:
        return "–"
    if not math.isfinite(distance):
        return f"{distance} mm"
    millimetres = exactly(distance) * 1000
    if 0 < millimetres < Decimal(1).scaleb(-decimals):
        return f"{rounded_up(millimetres, -millimetres.adjusted()):.1g} mm"
    return f"{rounded_up(millimetres, decimals):.{decimals}f} mm"


def exactly(value: float) -> Decimal:
    """Return a number as it is written: 0.002 is two thousandths, and not what a binary number can hold of them."""
    return Decimal(repr(float(value)))


def rounded_up(value: Decimal, decimals: int) -> Decimal:
    """Return a number rounded up to so many decimals."""
    return value.quantize(Decimal(1).scaleb(-decimals), ROUND_CEILING)
