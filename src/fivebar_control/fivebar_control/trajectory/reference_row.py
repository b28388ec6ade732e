"""Desired instants as rows of an array, which compiled functions take by the hundred."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from fivebar_control.laws.reference import Reference
from fivebar_control.model.state import Leg, State

LEG_VALUES = len(Leg._fields)
REFERENCE_VALUES = 2 * LEG_VALUES + 4 + len(Reference._fields) - 1
"""Numbers of a leg and of a desired instant in the row of an array."""


def write_reference(reference: Reference, row: NDArray[np.float64]) -> None:
    """Write a desired instant into a row, [REFERENCE_VALUES]: both legs, the platform, and the rest in order."""
    state = reference.state
    for index, value in enumerate(state.leg1):
        row[index] = value
    for index, value in enumerate(state.leg2):
        row[LEG_VALUES + index] = value
    row[24], row[25], row[26], row[27] = state.x, state.y, state.vx, state.vy
    row[28], row[29], row[30], row[31] = reference.ax, reference.ay, reference.f1, reference.f2
    row[32], row[33], row[34] = 1.0 if reference.by_motors else 0.0, reference.u1, reference.u2


def reference_of(row: NDArray[np.float64] | Sequence[float]) -> Reference:
    """Return the desired instant of such a row."""
    r = row
    leg1 = Leg(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], r[9], r[10], r[11])
    leg2 = Leg(r[12], r[13], r[14], r[15], r[16], r[17], r[18], r[19], r[20], r[21], r[22], r[23])
    return Reference(
        State(leg1, leg2, r[24], r[25], r[26], r[27]), r[28], r[29], r[30], r[31], r[32] != 0.0, r[33], r[34]
    )
