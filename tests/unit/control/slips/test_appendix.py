# SPDX-License-Identifier: Apache-2.0
"""Slips in appendix A, with the thesis' convention A = U^T Sigma V."""

from __future__ import annotations

import numpy as np
import pytest
from slip_cases import MASS, ROBOT, Vector, beside, pinocchio_motion

from fivebar_control.model.dynamics import direct_dynamics

TORQUE = np.array([1.0, 0.4])


def decomposition() -> tuple[Vector, Vector, Vector]:
    """U, Sigma, V with A = U^T Sigma V: numpy's u is the thesis' U^T, its vh the thesis' V.

    V is turned into a rotation: a reflection is its own transpose, and would hide the difference.
    """
    u, s, vh = np.linalg.svd(beside().a)
    turn = np.diag([1.0, np.linalg.det(vh)])
    return turn @ u.T, np.diag(s), turn @ vh


def wrench_and_multipliers() -> tuple[Vector, Vector]:
    state = beside().state
    motion = direct_dynamics(ROBOT, state, *TORQUE.tolist(), 0.0, 0.0)
    return MASS * pinocchio_motion(state, TORQUE)[1], np.array([motion.lambda1, motion.lambda2])


def test_4_13_has_lost_its_multipliers() -> None:
    u, sigma, v = decomposition()
    wrench, multipliers = wrench_and_multipliers()
    assert (v.T @ sigma @ u).shape == (2, 2)
    np.testing.assert_allclose(v.T @ sigma @ u @ multipliers, wrench, atol=1e-10)
    assert np.linalg.norm(wrench) == pytest.approx(1.816, abs=1e-3)


def test_4_14_multiplies_by_v_and_not_by_its_transpose() -> None:
    """Sigma U lambda = V w_p; with V^T it is off by 1.5 of 1.8 N."""
    u, sigma, v = decomposition()
    wrench, multipliers = wrench_and_multipliers()
    np.testing.assert_allclose(sigma @ u @ multipliers, v @ wrench, atol=1e-10)
    assert np.linalg.norm(sigma @ u @ multipliers - v.T @ wrench) == pytest.approx(1.538, abs=1e-3)


def test_the_kernel_is_the_last_row_of_v() -> None:
    """The text takes the last row of V^T: A times that is 1.09 long instead of 0; the first row of V is no better."""
    at = beside()
    v = decomposition()[2]
    wrench = wrench_and_multipliers()[0]
    assert np.linalg.norm(at.a @ v[-1]) < 1e-13
    assert np.linalg.norm(at.a @ v.T[-1]) == pytest.approx(1.085, abs=1e-3)
    assert abs(v[-1] @ wrench) < 1e-10
    # 4.15 as it can be read, with the first line
    assert abs(v[0] @ wrench) == pytest.approx(float(np.linalg.norm(wrench)), abs=1e-10)


def test_4_17_is_zero() -> None:
    """Printed without a right-hand side, which is what makes 4.18 follow."""
    u, sigma, v = decomposition()
    assert np.linalg.norm(u.T @ sigma @ v @ v[-1]) < 1e-13
