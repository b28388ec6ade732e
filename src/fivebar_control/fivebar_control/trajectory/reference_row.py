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
    state = State(
        _leg_of(row, 0), _leg_of(row, LEG_VALUES), float(row[24]), float(row[25]), float(row[26]), float(row[27])
    )
    return Reference(
        state,
        float(row[28]),
        float(row[29]),
        float(row[30]),
        float(row[31]),
        row[32] != 0.0,
        float(row[33]),
        float(row[34]),
    )


def _leg_of(row: NDArray[np.float64] | Sequence[float], first: int) -> Leg:
    """Return the leg whose values begin at an index; as plain numbers, with which Python computes faster."""
    return Leg(
        float(row[first]),
        float(row[first + 1]),
        float(row[first + 2]),
        float(row[first + 3]),
        float(row[first + 4]),
        float(row[first + 5]),
        float(row[first + 6]),
        float(row[first + 7]),
        float(row[first + 8]),
        float(row[first + 9]),
        float(row[first + 10]),
        float(row[first + 11]),
    )
