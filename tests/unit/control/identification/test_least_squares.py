# SPDX-License-Identifier: Apache-2.0
"""Weighted least squares: what textbooks give, and intervals that cover where residuals are correlated."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.linalg import lstsq

from fivebar_control.identification.least_squares import conditioning, fit, parzen

Array = NDArray[np.float64]

TRUE = np.array([2.0, -0.7, 0.3])


def slow_regressor(random: np.random.Generator, rows: int) -> Array:
    """[rows, 2, 3]: columns that change as slowly as the motion of a robot."""
    white = random.normal(size=(rows + 40, 2, 3))
    return np.stack([np.convolve(white[:, i, p], np.ones(41) / 6.4, "valid") for i in range(2) for p in range(3)], 1)[
        :rows
    ].reshape(rows, 2, 3)


def correlated(random: np.random.Generator, rows: int) -> Array:
    """[rows, 2]: noise through a filter 12 rows long, motor 2 ten times louder."""
    white = random.normal(size=(rows + 11, 2))
    noise = np.stack([np.convolve(white[:, i], np.ones(12) / math.sqrt(12.0), "valid") for i in range(2)], axis=1)
    return noise * [0.02, 0.2]


def test_values_are_those_of_the_weighted_problem() -> None:
    """Against scipy, with the weights that the residuals of the solution itself ask for."""
    random = np.random.default_rng(1)
    regressor = slow_regressor(random, 400)
    torque = regressor @ TRUE + correlated(random, 400)
    found = fit(regressor, torque, 12)
    weighted = (regressor / found.deviations[:, None]).reshape(-1, 3)
    expected = lstsq(weighted, (torque / found.deviations).reshape(-1))[0]
    assert np.allclose(found.values, expected, atol=1e-9)
    assert found.deviations == pytest.approx([0.02, 0.2], rel=0.15)
    assert np.allclose(found.residuals, torque - regressor @ found.values)


def test_a_loud_motor_counts_little() -> None:
    random = np.random.default_rng(4)
    errors = []
    for _ in range(40):
        regressor = slow_regressor(random, 300)
        torque = regressor @ TRUE + correlated(random, 300)
        plain = np.linalg.lstsq(regressor.reshape(-1, 3), torque.reshape(-1), rcond=None)[0]
        errors.append([np.linalg.norm(fit(regressor, torque, 12).values - TRUE), np.linalg.norm(plain - TRUE)])
    weighted, unweighted = np.sqrt(np.mean(np.square(errors), axis=0))
    assert weighted < 0.3 * unweighted


def test_rows_with_nan_are_left_out() -> None:
    random = np.random.default_rng(2)
    regressor = slow_regressor(random, 200)
    torque = regressor @ TRUE + correlated(random, 200)
    whole = fit(regressor[:150], torque[:150], 10)
    regressor[150:, 0, 1] = math.nan
    torque[150:, 1] = math.nan
    holed = fit(regressor, torque, 10)
    assert np.allclose(holed.values, whole.values, atol=1e-9)
    assert holed.independent == whole.independent
    assert np.isnan(holed.residuals[150:]).all()


def test_intervals_cover_where_the_textbook_ones_do_not() -> None:
    random = np.random.default_rng(8)
    covered, naively = [], []
    for _ in range(200):
        regressor = slow_regressor(random, 600)
        torque = regressor @ TRUE + correlated(random, 600)
        found = fit(regressor, torque, 30)
        covered.append(np.abs(found.values - TRUE) <= found.half_widths)
        weighted = (regressor / found.deviations[:, None]).reshape(-1, 3)
        textbook = 1.96 * np.sqrt(np.diag(np.linalg.inv(weighted.T @ weighted)))
        naively.append(np.abs(found.values - TRUE) <= textbook)
    # 600 pairs: the standard deviation of a share of 95 % is 0.9 %
    assert 0.92 <= np.mean(covered) <= 0.985
    assert np.mean(naively) < 0.75


def test_condition_number_names_what_cannot_be_told_apart() -> None:
    random = np.random.default_rng(3)
    rows = random.normal(size=(500, 4)) * [1e3, 1.0, 1e-3, 1.0]
    condition, _ = conditioning(rows)
    assert condition < 1.3
    rows[:, 3] = 0.5 * rows[:, 1] + 1e-4 * random.normal(size=500)
    condition, weakest = conditioning(rows)
    # two unit columns at an angle d: cond = cot(d / 2), and tan d = 1e-4 / 0.5
    assert condition == pytest.approx(2.0 / 2e-4, rel=0.1)
    assert np.abs(weakest) == pytest.approx([0.0, math.sqrt(0.5), 0.0, math.sqrt(0.5)], abs=1e-3)


def test_a_column_of_zeros_is_named() -> None:
    rows = np.ones((10, 2))
    rows[:, 0] = 0.0
    condition, weakest = conditioning(rows)
    assert condition == math.inf
    assert weakest.tolist() == [1.0, 0.0]


def test_fewer_rows_than_parameters_are_refused() -> None:
    regressor = np.full((5, 2, 3), math.nan)
    regressor[0] = 1.0
    with pytest.raises(ValueError, match="2 rows for 3 parameters"):
        fit(regressor, np.ones((5, 2)), 2)


def test_parzens_weights_fade_from_one_to_zero_and_keep_sums_positive() -> None:
    lags = np.arange(-400, 401) / 100.0
    weights = np.array([parzen(abs(lag)) for lag in lags.tolist()])
    assert (parzen(0.0), parzen(0.5), parzen(1.0), parzen(2.0)) == (1.0, 0.25, 0.0, 0.0)
    assert np.min(np.fft.fft(np.fft.ifftshift(weights)).real) > -1e-9
