# SPDX-License-Identifier: Apache-2.0
"""Least squares with a few parameters and a chain of states, each row with one state or two neighbouring ones.

The normal equations have the shape of an arrow: the block of the states is tridiagonal, so that a step costs a time
proportional to their number, where a dense method would take its cube.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import solveh_banded

FloatArray = NDArray[np.float64]


class Rows(NamedTuple):
    """Linearised residuals r + J_p dp + J_s ds, each in units of its standard deviation.

    Attributes:
        residual: [n].
        by_parameters: [n, p].
        by_state: [n], by the row's own state k.
        by_next: [n], by state k + 1; 0 for a row with one state.
        state: [n], k.
    """

    residual: FloatArray
    by_parameters: FloatArray
    by_state: FloatArray
    by_next: FloatArray
    state: NDArray[np.int64]


class Reduced(NamedTuple):
    """The normal equations without the states.

    Attributes:
        information: [p, p], of the parameters from these rows.
        gradient: [p].
        response: [s, p], how the states follow the parameters: ds = offset + response dp.
        offset: [s].
    """

    information: FloatArray
    gradient: FloatArray
    response: FloatArray
    offset: FloatArray


def reduced(rows: Rows, states: int, damping: float = 0.0) -> Reduced:
    """Return the normal equations of the parameters, the states eliminated.

    Args:
        rows: residuals.
        states: their number s.
        damping: added to each state's diagonal, as a share of it.
    """
    state, next_state = rows.state, np.minimum(rows.state + 1, states - 1)
    diagonal = np.bincount(state, rows.by_state**2, states) + np.bincount(next_state, rows.by_next**2, states)
    beside = np.bincount(state, rows.by_state * rows.by_next, states)
    mixed = np.stack(
        [
            np.bincount(state, rows.by_state * column, states) + np.bincount(next_state, rows.by_next * column, states)
            for column in (*rows.by_parameters.T, rows.residual)
        ],
        axis=1,
    )
    banded = np.zeros((2, states))
    banded[1] = diagonal * (1.0 + damping)
    banded[0, 1:] = beside[:-1]
    solved = solveh_banded(banded, mixed)
    response, offset = -solved[:, :-1], -solved[:, -1]
    information = rows.by_parameters.T @ rows.by_parameters + mixed[:, :-1].T @ response
    gradient = rows.by_parameters.T @ rows.residual + mixed[:, :-1].T @ offset
    return Reduced(0.5 * (information + information.T), gradient, response, offset)


def projected(rows: Rows, response: FloatArray) -> FloatArray:
    """Return [n, p], the derivatives of the rows by the parameters with states that follow these."""
    after = np.minimum(rows.state + 1, len(response) - 1)
    return rows.by_parameters + rows.by_state[:, None] * response[rows.state] + rows.by_next[:, None] * response[after]
