# SPDX-License-Identifier: Apache-2.0
"""Slips in section 3.3: the angle beta (3.40, 3.41), its rotation (3.42 to 3.44) and the numbers of 3.45."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slip_cases import BASE, LINK, Vector, beside

from fivebar_control.model.geometry import wrap
from fivebar_control.model.singularity import parallel_svd

Q11, Q12, Q21, Q22, BETA = 3.1218, -2.6846, 2.0933, -4.7977, 0.4373
"""As printed in 3.45."""


def rotation(angle: float) -> Vector:
    return np.array([[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]])


def transposed_a() -> Vector:
    return np.array([[math.cos(Q11 + Q12), math.cos(Q21 + Q22)], [math.sin(Q11 + Q12), math.sin(Q21 + Q22)]])


def test_the_printed_angles_close_both_legs_at_the_printed_place() -> None:
    """To the four decimals given, so the posture is right; what is wrong is the second column of 3.45."""
    for base, active, passive in ((-BASE / 2.0, Q11, Q12), (BASE / 2.0, Q21, Q22)):
        x = base + LINK * (math.cos(active) + math.cos(active + passive))
        y = LINK * (math.sin(active) + math.sin(active + passive))
        assert (x, y) == pytest.approx((-0.06745, 0.03989), abs=2e-5)


def test_the_second_column_of_3_45_has_lost_its_sign() -> None:
    printed = np.array([[0.9059, 0.9060], [0.4235, 0.4235]])
    np.testing.assert_allclose(transposed_a()[:, 0], printed[:, 0], atol=2e-4)
    np.testing.assert_allclose(transposed_a()[:, 1], -printed[:, 1], atol=2e-4)
    assert parallel_svd(beside().state).fold == -1.0


def test_3_40_and_3_41_are_one_expression_and_neither_gives_the_printed_beta() -> None:
    """3.40 with 3.39 put in is 3.41. The number used is q11 + q12; by leg 2 it is pi further."""
    q13 = Q21 + Q22 - Q11 - Q12
    assert Q11 + Q12 + q13 == pytest.approx(Q21 + Q22, abs=1e-15)
    assert abs(wrap(Q21 + Q22 - BETA)) == pytest.approx(math.pi, abs=2e-4)
    assert pytest.approx(BETA, abs=2e-4) == Q11 + Q12


def test_the_rotation_of_3_42_must_be_transposed() -> None:
    """R(beta) turns the links to 2 beta: the first row is 0.641; R(beta)^T gives (1, -1)."""
    a_transposed = transposed_a()
    np.testing.assert_allclose(rotation(BETA) @ a_transposed, [[0.6414, -0.6414], [0.7672, -0.7672]], atol=3e-4)
    np.testing.assert_allclose(rotation(BETA).T @ a_transposed, [[1.0, -1.0], [0.0, 0.0]], atol=3e-4)


def test_the_product_of_the_printed_matrices_of_3_45_is_not_what_is_printed() -> None:
    left = np.array([[0.9059, -0.4235], [0.4235, 0.9059]])
    right = np.array([[0.9059, 0.9060], [0.4235, 0.4235]])
    product = left @ right
    np.testing.assert_allclose(product, [[0.6413, 0.6414], [0.7673, 0.7673]], atol=1e-4)
    assert np.abs(product - [[1.0, 1.0], [0.0, 0.0]]).max() == pytest.approx(0.7673, abs=1e-4)


def test_3_42_multiplies_a_column_by_a_column() -> None:
    """A_s^T lambda is 2x1 times 2x1; R^T A^T lambda is meant, whose first row is A_s lambda."""
    at = beside()
    a_s, multipliers = np.array([[1.0, -1.0]]), np.array([[2.0], [0.7]])
    with pytest.raises(ValueError, match="mismatch"):
        a_s.T @ multipliers
    angle = at.state.leg1.q1 + at.state.leg1.q2
    np.testing.assert_allclose(rotation(angle).T @ at.a.T @ multipliers, [[1.3], [0.0]], atol=1e-12)
    np.testing.assert_allclose(a_s @ multipliers, [[1.3]])
