"""Blending of the candidate torques (4.1, 4.2)."""

from __future__ import annotations

from fivebar_control.laws.torque import Torque


def blend(sigma: float, away: Torque, on_locus: Torque) -> Torque:
    """Return u = (1 - sigma) u1 + sigma u2.

    A candidate with zero weight is not multiplied but left out, so that it may be NaN there.
    """
    if sigma <= 0.0:
        return away
    if sigma >= 1.0:
        return on_locus
    return Torque(
        (1.0 - sigma) * away.tau1 + sigma * on_locus.tau1,
        (1.0 - sigma) * away.tau2 + sigma * on_locus.tau2,
    )
