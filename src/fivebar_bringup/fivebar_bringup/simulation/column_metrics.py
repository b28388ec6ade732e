# SPDX-License-Identifier: Apache-2.0
"""Metrics of the columns of a run's table, compiled, offline or recorded; what is not known is NaN, and left out."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

ROUNDING = 1e-9
"""Share of a limit that is no excess: a law that respects the limit requests it to within a rounding error."""


def largest(values: FloatArray) -> float:
    """Return the largest magnitude in an array, NaN where there is none."""
    return float(np.fmax.reduce(np.abs(values), axis=None, initial=math.nan))


def peak(values: FloatArray) -> float | None:
    """Return the largest magnitude in an array; None where there is none or it is infinite."""
    return finite(largest(values))


def rms(values: FloatArray) -> float | None:
    """Return the root mean square of an array; None where there is none or it is infinite."""
    known = values[~np.isnan(values)]
    most = peak(known)
    if not most:
        return most
    # scaled, so that the squares of a diverged run's errors do not overflow
    return finite(most * math.sqrt(float(np.mean((known / most) ** 2))))


def sign_changes(values: FloatArray) -> int:
    """Return how often a series changes its sign; zeros count for neither sign."""
    signs = np.sign(values[~np.isnan(values) & (values != 0.0)])
    return int(np.count_nonzero(np.diff(signs)))


def saturated(requested: Sequence[FloatArray] | FloatArray, limit: float) -> int:
    """Return at how many of n samples a requested torque (Nm) of either motor, [2][n], exceeds the limit."""
    first, second = (np.abs(torques) > limit * (1.0 + ROUNDING) for torques in requested)
    return int(np.count_nonzero(first | second))


def finite(value: float) -> float | None:
    """Return a metric, None for one that is not known or infinite."""
    return value if math.isfinite(value) else None
