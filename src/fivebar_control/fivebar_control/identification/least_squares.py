# SPDX-License-Identifier: Apache-2.0
"""Weighted least squares of two motors' equations, with intervals that allow for correlated residuals.

Each motor's rows are weighted by the inverse variance of its own residuals, iterated. Filtering makes neighbouring
residuals alike, so that the textbook covariance, which takes every row as independent, is far too small. The covariance
here is the sandwich (X^T W X)^-1 S (X^T W X)^-1 in which S sums the products of the scores X^T W e of all pairs of rows
up to a lag, fading out with Parzen's weights (Newey and West's idea, which keeps S positive).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.special import stdtrit

FloatArray = NDArray[np.float64]

CONFIDENCE = 0.95
"""Confidence of the intervals."""

MODEL_SHARE = 0.75
"""Part of the difference between filters that counts as an error of the model: larger cut-offs change less than lower
ones, which show the error most clearly. Chosen by the coverage of simulated robots."""

ITERATIONS = 20
SETTLED = 1e-9
"""Relative change of the weights at which the iteration ends."""


class Fit(NamedTuple):
    """Result of the least squares.

    Attributes:
        values: [p], the parameters.
        half_widths: [p], of their intervals at `CONFIDENCE`.
        covariance: [p, p].
        condition: condition number of the weighted regressor whose columns are scaled to unit length.
        weakest: [p], the combination of the scaled parameters that the data determine least, of unit length.
        deviations: [2], standard deviation of each motor's residuals.
        residuals: [n, 2], measured minus predicted, NaN where a row was left out.
        independent: how many independent rows the covariance rests on.
    """

    values: FloatArray
    half_widths: FloatArray
    covariance: FloatArray
    condition: float
    weakest: FloatArray
    deviations: FloatArray
    residuals: FloatArray
    independent: float


def widened(solution: Fit, others: Sequence[Fit]) -> Fit:
    """Return a fit whose intervals also cover what the model leaves out.

    Fits of the same record through other filters would find the same, were the model the robot's: noise aside, they
    differ by what elasticity, smoothed reversals and other errors of the model do at the filters' frequencies. A part
    of the largest difference counts as a half width of its own.
    """
    shift = MODEL_SHARE * np.max([np.abs(other.values - solution.values) for other in others], axis=0)
    quantile = solution.half_widths / np.sqrt(np.diag(solution.covariance))
    covariance = solution.covariance + np.diag((shift / quantile) ** 2)
    return solution._replace(covariance=covariance, half_widths=quantile * np.sqrt(np.diag(covariance)))


def conditioning(regressor: FloatArray) -> tuple[float, FloatArray]:
    """Return the condition number of a regressor [rows, p] with unit columns, and its weakest direction [p].

    Infinite, with the column itself, where a column is zero.
    """
    lengths = np.sqrt(np.sum(regressor**2, axis=0))
    if not np.all(lengths > 0.0):
        return float("inf"), np.asarray(lengths == 0.0, dtype=np.float64)
    _, singular, directions = np.linalg.svd(regressor / lengths, full_matrices=False)
    if len(singular) < len(lengths) or singular[-1] == 0.0:
        return float("inf"), directions[-1]
    return float(singular[0] / singular[-1]), directions[-1]


def fit(regressor: FloatArray, torque: FloatArray, lag: int) -> Fit:
    """Return the parameters that explain the torques.

    Args:
        regressor: [n, 2, p], row k, motor i; any NaN leaves that equation out.
        torque: [n, 2], the same.
        lag: rows after which residuals are taken for independent.

    Raises:
        ValueError: there are fewer rows than parameters.
    """
    used = np.all(np.isfinite(regressor), axis=2) & np.isfinite(torque)
    count = used.sum(axis=0)
    parameters = regressor.shape[2]
    if used.sum() <= parameters:
        raise ValueError(f"{used.sum()} rows for {parameters} parameters")
    rows = np.where(used[:, :, None], regressor, 0.0)
    right = np.where(used, torque, 0.0)
    deviations = np.ones(2)
    for _ in range(ITERATIONS):
        scaled = (rows / deviations[:, None]).reshape(-1, parameters)
        values = np.asarray(np.linalg.lstsq(scaled, (right / deviations).reshape(-1), rcond=None)[0], dtype=np.float64)
        residuals = right - rows @ values
        scatter = np.sqrt(np.sum(residuals**2, axis=0) / np.maximum(count - 0.5 * parameters, 1.0))
        # a motor whose torques are explained to the last digit must not get an infinite weight
        scatter = np.maximum(scatter, 1e-12 * np.max(np.abs(right)))
        settled = bool(np.all(np.abs(scatter - deviations) <= SETTLED * deviations))
        deviations = scatter
        if settled:
            break
    condition, weakest = conditioning(scaled)
    independent = used.any(axis=1).sum() / max(lag, 1)
    covariance = _sandwich(rows / deviations[:, None], residuals / deviations, lag)
    freedom = max(independent - 0.5 * parameters, 1.0)
    quantile = float(stdtrit(freedom, 0.5 * (1.0 + CONFIDENCE)))
    covariance = covariance * independent / freedom
    return Fit(
        values=values,
        half_widths=quantile * np.sqrt(np.diag(covariance)),
        covariance=covariance,
        condition=condition,
        weakest=weakest,
        deviations=deviations,
        residuals=np.where(used, residuals, np.nan),
        independent=float(independent),
    )


def _sandwich(rows: FloatArray, residuals: FloatArray, lag: int) -> FloatArray:
    """Return the covariance [p, p] from weighted rows [n, 2, p] and residuals [n, 2]."""
    scores = np.einsum("nip,ni->np", rows, residuals)
    spread = scores.T @ scores
    for shift in range(1, min(lag, len(scores))):
        along = parzen(shift / lag) * (scores[shift:].T @ scores[:-shift])
        spread += along + along.T
    normal = np.einsum("nip,niq->pq", rows, rows)
    scale = np.sqrt(np.diag(normal))
    inverse = np.linalg.inv(normal / np.outer(scale, scale)) / np.outer(scale, scale)
    return np.asarray(inverse @ spread @ inverse)


def parzen(u: float) -> float:
    """Return Parzen's weight of a lag that is the fraction u >= 0 of the longest: 1 at 0, 0 from 1 on."""
    if u <= 0.5:
        return 1.0 - 6.0 * u * u * (1.0 - u)
    return 2.0 * (1.0 - u) ** 3 if u < 1.0 else 0.0
