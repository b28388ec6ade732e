"""The written-out 6x6 algebra against numpy's."""

from __future__ import annotations

from typing import Any

import numpy as np

from fivebar_control.estimation.covariance import ProcessNoise, diagonal, measured, process_noise, propagated

Matrix = np.ndarray[Any, np.dtype[np.float64]]


def rows(matrix: Matrix) -> Any:
    return tuple(tuple(row) for row in matrix.tolist())


def random_covariance(random: np.random.Generator) -> Matrix:
    root = random.normal(size=(6, 6)) * np.array([1e-4, 1e-4, 1e-2, 1e-2, 0.1, 0.1])[:, None]
    full = root @ root.T
    return np.asarray(np.tril(full) + np.tril(full, -1).T)


def noise_matrix(noise: ProcessNoise) -> Matrix:
    q = np.zeros((6, 6))
    q[0, 0] = q[1, 1] = noise.position
    q[2, 2] = q[3, 3] = noise.velocity
    q[4, 4] = q[5, 5] = noise.disturbance
    q[0, 2] = q[2, 0] = q[1, 3] = q[3, 1] = noise.mixed
    return q


def test_noise_of_a_period_is_that_of_white_acceleration_and_walking_disturbances() -> None:
    period, acceleration, rate = 0.002, 0.3, 2.0
    noise = process_noise(acceleration, rate, period)
    # many small steps, each with white noise on the velocity and on the disturbance
    steps = 400
    h = period / steps
    step = np.eye(6)
    step[0, 2] = step[1, 3] = h
    grown = np.zeros((6, 6))
    added = np.diag([0.0, 0.0, acceleration**2 * h, acceleration**2 * h, rate**2 * h, rate**2 * h])
    for _ in range(steps):
        grown = step @ grown @ step.T + added
    np.testing.assert_allclose(noise_matrix(noise), grown, rtol=0.01, atol=1e-18)


def test_propagation_is_f_p_ft_plus_q_and_stays_symmetric() -> None:
    random = np.random.default_rng(0)
    noise = process_noise(0.1, 1.0, 0.002)
    for _ in range(50):
        p, f = random_covariance(random), random.normal(size=(4, 6))
        full = np.vstack([f, np.eye(6)[4:]])
        found = np.array(propagated(rows(p), rows(f), noise))
        np.testing.assert_allclose(found, full @ p @ full.T + noise_matrix(noise), rtol=1e-12, atol=1e-14)
        assert np.array_equal(found, found.T)


def test_measurement_is_the_kalman_update_and_stays_symmetric_and_positive() -> None:
    random = np.random.default_rng(1)
    for _ in range(50):
        p, variance = random_covariance(random), 1e-9
        h = np.array([*random.normal(size=2) * 10.0, 0.0, 0.0, 0.0, 0.0])
        gain = p @ h / (h @ p @ h + variance)
        found, found_gain = measured(rows(p), float(h[0]), float(h[1]), variance)
        np.testing.assert_allclose(found_gain, gain, rtol=1e-9)
        np.testing.assert_allclose(np.array(found), p - np.outer(gain, h @ p), rtol=1e-6, atol=1e-14)
        assert np.array_equal(np.array(found), np.array(found).T)
        assert np.linalg.eigvalsh(np.array(found)).min() > -1e-15


def test_independent_states_have_a_diagonal_covariance() -> None:
    assert np.array_equal(np.array(diagonal((1.0, 2.0, 3.0, 4.0, 5.0, 6.0))), np.diag([1.0, 2.0, 3.0, 4.0, 5.0, 6.0]))
