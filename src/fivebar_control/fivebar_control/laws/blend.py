"""Blending of the candidate torques (4.1, 4.2)."""

from __future__ import annotations

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
