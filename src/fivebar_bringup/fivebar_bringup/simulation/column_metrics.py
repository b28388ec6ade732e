# SPDX-License-Identifier: Apache-2.0
"""Metrics of a column of a run's table, compiled, offline or recorded."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]


def largest(values: FloatArray) -> float:
    """Return the largest magnitude, NaN left out, 0 where there is none."""
    return float(np.fmax.reduce(np.abs(values), initial=0.0))


def sign_changes(values: FloatArray) -> int:
    """Return how often a series changes its sign; zeros and NaN count for neither sign."""
    signs = np.sign(values[~np.isnan(values) & (values != 0.0)])
    return int(np.count_nonzero(np.diff(signs)))
