"""The performance-based supervisor (4.1.2): the weight of the virtual constraint law, from cond(A)."""

from __future__ import annotations

import math


def blending_weight(kappa: float, epsilon: float) -> float:
    """Return sigma = clip(2 - kappa / epsilon, 0, 1), kappa = 1 / cond(A).

    1 where kappa <= epsilon (at the locus) and 0 where kappa >= 2 epsilon. The printed table has the two ends exchanged
    against its own sentence. An epsilon of 0 means that no crossing is planned: 0 everywhere but on the locus itself.
    NaN where kappa is, as out of reach.
    """
    if kappa >= 2.0 * epsilon:
        return 0.0 if kappa > 0.0 else 1.0
    if kappa <= epsilon:
        return 1.0
    return 2.0 - kappa / epsilon if epsilon > 0.0 else math.nan
