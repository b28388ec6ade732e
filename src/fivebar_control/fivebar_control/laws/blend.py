# SPDX-License-Identifier: Apache-2.0
"""Blending of the candidate torques (4.1, 4.2), and the weight of the virtual constraint law.

The weight follows from cond(A) (4.1.2), or from how soon the estimated state is on the locus.
"""

from __future__ import annotations

import math

from fivebar_control.laws.torque import Torque


def blend(sigma: float, nominal: Torque, constraint: Torque) -> Torque:
    """Return u = (1 - sigma) u1 + sigma u2.

    A candidate with zero weight is not multiplied but left out, so that it may be NaN there.
    """
    if sigma <= 0.0:
        return nominal
    if sigma >= 1.0:
        return constraint
    return Torque(
        (1.0 - sigma) * nominal.tau1 + sigma * constraint.tau1,
        (1.0 - sigma) * nominal.tau2 + sigma * constraint.tau2,
    )


def forecast_width(kappa_rate: float, zone_time: float, epsilon: float) -> float:
    """Return the half width of the blending zone (in kappa) for the speed at which the estimated state passes it.

    The platform coasts through the zone, so the estimate forecasts it to first order: it is on the locus in the time
    kappa / kappa_rate, and the zone holds all that is nearer than half of `zone_time`.

    Args:
        kappa_rate: |d kappa / dt| of the estimated state (1/s).
        zone_time: for which sigma is meant to be 1 (s).
        epsilon: half width of the planned zone; 0 where none is planned, which leaves none.
    """
    return 0.5 * zone_time * kappa_rate if epsilon > 0.0 else 0.0


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
