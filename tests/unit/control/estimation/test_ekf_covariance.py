# SPDX-License-Identifier: Apache-2.0
"""The covariance of the filter's states and of the constant errors, against joint linear-Gaussian algebra."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fivebar_control.estimation.covariance import (
    BIAS,
    CLOCK_ERROR,
    ERRORS,
    ERRORS_END,
    FX,
    FY,
    SIZE,
    ProcessNoise,
    measured,
    process_noise,
    propagated,
    with_torque_noise,
)

Matrix = np.ndarray[Any, np.dtype[np.float64]]

MOVING = (0, 1, 2, 3, 4, 5, FX, FY)
"""Columns of the transition: x, y, vx, vy, d1, d2 and the force."""

SCALES = np.array([1e-4, 1e-4, 1e-2, 1e-2, 0.1, 0.1, 0.02, 1e-3, 1e-3, *[2e-4] * 6, 0.01, 1e-3, 1e-3, 0.5, 0.5])

CONSTANT = slice(ERRORS, ERRORS_END)


def random_covariance(random: np.random.Generator, errors: bool = True) -> Matrix:
    root = random.normal(size=(SIZE, SIZE)) * SCALES[:, None]
    if not errors:
        root[CONSTANT] = 0.0
    full = root @ root.T
    return np.asarray(np.tril(full) + np.tril(full, -1).T)


def random_row(random: np.random.Generator) -> Matrix:
    """A measurement of everything, each entry of about the same weight."""
    return np.asarray(random.normal(size=SIZE) / SCALES * 1e-3)


def noise_matrix(noise: ProcessNoise) -> Matrix:
    q = np.zeros((SIZE, SIZE))
    q[0, 0] = q[1, 1] = noise.position
    q[2, 2] = q[3, 3] = noise.velocity
    q[4, 4] = q[5, 5] = noise.disturbance
    q[6, 6] = noise.bias
    q[CLOCK_ERROR, CLOCK_ERROR] = noise.clock
    q[FX, FX] = q[FY, FY] = noise.force
    q[0, 2] = q[2, 0] = q[1, 3] = q[3, 1] = noise.mixed
    return q


def full_transition(rows: Matrix, noise: ProcessNoise) -> Matrix:
    full = np.eye(SIZE)
    full[:4, MOVING] = rows
    full[FX, FX] = full[FY, FY] = noise.force_kept
    return full


def expect_covariance(matrix: Matrix) -> None:
    """Symmetric to the last bit, and positive semi-definite in units of each entry's own size."""
    assert np.array_equal(matrix, matrix.T)
    scaled = matrix / np.outer(SCALES, SCALES)
    assert np.linalg.eigvalsh(scaled).min() > -1e-12 * float(np.abs(scaled).max())


def test_noise_of_a_period_is_that_of_white_acceleration_and_random_walks() -> None:
    period, acceleration, rate, bias, clock = 0.002, 0.3, 2.0, 0.05, 1e-3
    force, memory = 1.5, 0.05
    noise = process_noise(acceleration, rate, bias, clock, period, force, memory)
    # many small steps, each with white noise on the velocity and on what walks at random
    steps = 400
    h = period / steps
    step = np.eye(SIZE)
    step[0, 2] = step[1, 3] = h
    grown = np.zeros((SIZE, SIZE))
    added = np.zeros((SIZE, SIZE))
    added[2, 2] = added[3, 3] = acceleration**2 * h
    added[4, 4] = added[5, 5] = rate**2 * h
    added[BIAS, BIAS] = bias**2 * h
    added[CLOCK_ERROR, CLOCK_ERROR] = clock**2 * h
    # a force that forgets itself, and keeps its variance
    step[FX, FX] = step[FY, FY] = np.exp(-h / memory)
    added[FX, FX] = added[FY, FY] = 2.0 * force**2 / memory * h
    for _ in range(steps):
        grown = step @ grown @ step.T + added
    np.testing.assert_allclose(noise_matrix(noise), grown, rtol=0.01, atol=1e-18)


def test_propagation_is_f_p_ft_plus_q_and_stays_symmetric() -> None:
    random = np.random.default_rng(0)
    noise = process_noise(0.1, 1.0, 0.02, 1e-4, 0.002, 0.5, 0.05)
    for _ in range(50):
        p, f = random_covariance(random), random.normal(size=(4, len(MOVING)))
        full = full_transition(f, noise)
        found = propagated(p, f, noise)
        np.testing.assert_allclose(found, full @ p @ full.T + noise_matrix(noise), rtol=1e-12, atol=1e-14)
        assert np.array_equal(found, found.T)
        # constants: what they are among themselves stays, to the last bit
        assert np.array_equal(found[CONSTANT, CONSTANT], p[CONSTANT, CONSTANT])


def test_uncertain_torques_add_their_effect_on_place_and_velocity() -> None:
    random = np.random.default_rng(5)
    p, rows = random_covariance(random), random.normal(size=(4, len(MOVING)))
    expected = p.copy()
    expected[:4, :4] += 0.3 * np.outer(rows[:, 4], rows[:, 4]) + 0.7 * np.outer(rows[:, 5], rows[:, 5])
    np.testing.assert_allclose(with_torque_noise(p, rows, 0.3, 0.7), expected, rtol=1e-12)


@pytest.mark.parametrize("errors", [False, True])
def test_measurement_is_the_kalman_update(errors: bool) -> None:
    random = np.random.default_rng(1)
    for _ in range(50):
        p, h, variance = random_covariance(random, errors), random_row(random), 1e-9
        column = p @ h
        innovation = float(h @ column) + variance
        found = measured(p, h, variance)
        np.testing.assert_allclose(found.gain, column / innovation, rtol=1e-9)
        assert found.variance == pytest.approx(innovation, rel=1e-12)
        np.testing.assert_allclose(found.covariance, p - np.outer(column, column) / innovation, rtol=1e-6, atol=1e-14)
        # what is known exactly stays so, and no reading moves it
        assert errors == bool(np.any(found.covariance[CONSTANT]))
        assert errors == bool(np.any(found.gain[CONSTANT]))
        expect_covariance(found.covariance)


def test_with_errors_that_are_considered_the_covariance_is_that_of_the_gain_that_leaves_them_alone() -> None:
    """Joseph's form, which holds for any gain."""
    random = np.random.default_rng(2)
    for _ in range(50):
        p, h, variance = random_covariance(random), random_row(random), float(random.uniform(1e-9, 1e-3))
        gain = p @ h / (h @ p @ h + variance)
        gain[CONSTANT] = 0.0
        left = np.eye(SIZE) - np.outer(gain, h)
        found = measured(p, h, variance, estimates_errors=False)
        np.testing.assert_allclose(found.gain, gain, rtol=1e-9)
        assert np.array_equal(found.gain[CONSTANT], np.zeros(ERRORS_END - ERRORS))
        expected = left @ p @ left.T + variance * np.outer(gain, gain)
        difference = (found.covariance - expected) / np.outer(SCALES, SCALES)
        assert np.abs(difference).max() < 1e-10
        assert np.array_equal(found.covariance[CONSTANT, CONSTANT], p[CONSTANT, CONSTANT])
        expect_covariance(found.covariance)


def test_a_long_run_of_predictions_and_measurements_keeps_a_covariance() -> None:
    random = np.random.default_rng(3)
    noise = process_noise(0.1, 1.0, 0.02, 1e-4, 0.002, 0.5, 0.05)
    # constant errors that are independent of each other and of the states, as at the start
    p = np.diag(SCALES**2)
    for _ in range(2000):
        rows = np.eye(4, len(MOVING))
        rows[0, 2] = rows[1, 3] = 0.002
        rows[2:, 4:] = 0.01 * random.normal(size=(2, 4))
        p = propagated(p, rows, noise)
        for _ in range(2):
            h = np.zeros(SIZE)
            h[:2], h[ERRORS : ERRORS_END - 1] = 10.0 * random.normal(size=2), random.normal(size=8)
            p = measured(p, h, 1e-9).covariance
    expect_covariance(p)
    # of eight of them all combinations are seen, of the ninth none
    assert np.all(np.diag(p)[ERRORS : ERRORS_END - 1] < 0.1 * SCALES[ERRORS : ERRORS_END - 1] ** 2)
    assert p[ERRORS_END - 1, ERRORS_END - 1] == SCALES[ERRORS_END - 1] ** 2


def test_repeated_measurements_do_not_average_a_constant_error_out() -> None:
    """10 000 readings of one encoder: the state stays as uncertain as its zero, where noise alone would be nothing."""
    zero, noise = 1e-3, 1e-6
    p = np.zeros((SIZE, SIZE))
    p[0, 0], p[ERRORS, ERRORS] = 1.0, zero**2
    row = np.zeros(SIZE)
    row[0] = row[ERRORS] = 1.0
    for _ in range(10_000):
        p = measured(p, row, noise).covariance
    assert p[0, 0] == pytest.approx(zero**2, rel=0.01)
    assert p[0, ERRORS] == pytest.approx(-(zero**2), rel=0.01)


def test_the_covariance_is_that_of_simulated_errors() -> None:
    """Monte Carlo of the joint system: 40 000 sets of states and constant errors, ten periods, a measurement each."""
    random = np.random.default_rng(4)
    count, variance = 40_000, 1e-6
    noise = process_noise(0.1, 1.0, 0.5, 1e-4, 0.002, 0.5, 0.05)
    p = random_covariance(random)
    truth = random.multivariate_normal(np.zeros(SIZE), p, size=count, method="eigh")
    estimates = np.zeros((count, SIZE))
    for _ in range(10):
        rows = np.eye(4, len(MOVING))
        rows[0, 2] = rows[1, 3] = 0.002
        rows[2:, 4:] = 0.01 * random.normal(size=(2, 4))
        step, h = full_transition(rows, noise), random_row(random) * 0.1
        added = random.multivariate_normal(np.zeros(SIZE), noise_matrix(noise), size=count, method="eigh")
        truth, estimates = truth @ step.T + added, estimates @ step.T
        correction = measured(propagated(p, rows, noise), h, variance)
        innovations = (truth - estimates) @ h + random.normal(0.0, np.sqrt(variance), count)
        estimates = estimates + np.outer(innovations, correction.gain)
        assert float(np.var(innovations)) == pytest.approx(correction.variance, rel=0.04)
        p = correction.covariance
    found = np.cov((truth - estimates).T)
    deviations = np.sqrt(np.diag(p))
    # a correlation of so many draws is known to 0.005
    np.testing.assert_allclose(
        found / np.outer(deviations, deviations), p / np.outer(deviations, deviations), atol=0.03
    )
