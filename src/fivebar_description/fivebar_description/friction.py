"""Joint friction (1.32), with sign() smoothed so that it has a value at rest: of the model and of the plant alike."""

from __future__ import annotations

import math

from fivebar_description.parameters import LegParameters


def friction_torque(leg: LegParameters, dq1: float) -> float:
    """Return f = f_s tanh(dq1 / width) + f_off in Nm, for the motor speed dq1 in rad/s."""
    return leg.coulomb * math.tanh(dq1 / leg.width) + leg.offset


def friction_slope(leg: LegParameters, dq1: float) -> float:
    """Return df / d(dq1) in Nm s/rad, for the motor speed dq1 in rad/s."""
    smooth = math.tanh(dq1 / leg.width)
    return leg.coulomb * (1.0 - smooth * smooth) / leg.width
