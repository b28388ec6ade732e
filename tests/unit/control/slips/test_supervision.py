# SPDX-License-Identifier: Apache-2.0
"""Slips in chapter 4: the supervisor's table and the adaptive gain."""

from __future__ import annotations

import math

import pytest

from fivebar_control.laws.adaptive_gain import NO_MEMORY, gain_factors, gain_memory
from fivebar_control.laws.blend import blending_weight


def table_of_4_1_2(kappa: float, epsilon: float) -> float:
    """As printed; kappa = 1 / cond(A)."""
    if kappa >= 2.0 * epsilon:
        return 1.0
    if kappa <= epsilon:
        return 0.0
    condition = 1.0 / kappa
    return (1.0 - condition * epsilon) / (condition * epsilon)


def test_the_supervisors_table_is_upside_down() -> None:
    """Its own sentence wants 0 far from the locus and 1 on it; the table says 1 and 0. Mended it is one minus that."""
    epsilon = 0.05
    assert (table_of_4_1_2(1.0, epsilon), table_of_4_1_2(0.0, epsilon)) == (1.0, 0.0)
    assert (blending_weight(1.0, epsilon), blending_weight(0.0, epsilon)) == (0.0, 1.0)
    for kappa in (0.0, 0.01, 0.05, 0.0501, 0.06, 0.075, 0.09, 0.0999, 0.1, 0.5, 1.0):
        assert blending_weight(kappa, epsilon) == pytest.approx(1.0 - table_of_4_1_2(kappa, epsilon), abs=1e-12)


def test_both_coordinates_must_be_within_the_limit() -> None:
    """With the printed || a jump of 0.2 mm in y passes, because x has none."""
    limit = 1e-4
    jump_x, jump_y = 0.0, 2e-4
    assert jump_x <= limit or jump_y <= limit
    before = gain_memory(NO_MEMORY, False, 0.0, 0.0)
    inside = gain_memory(before, True, jump_x, jump_y)
    assert gain_factors(inside, jump_x, jump_y, 1.5, limit, True) == (2.25, 1.5)


def test_one_factor_on_both_gains_changes_the_damping() -> None:
    """Kd / (2 sqrt(Kp)) grows by sqrt(alpha): critical damping 1 becomes 1.225, and stays 1 with (alpha^2, alpha)."""
    kp, kd = 2500.0, 100.0
    damping = {}
    for keep in (False, True):
        before = gain_memory(NO_MEMORY, False, 0.0, 0.0)
        on_kp, on_kd = gain_factors(gain_memory(before, True, 1e-3, 0.0), 1e-3, 0.0, 1.5, 1e-4, keep)
        damping[keep] = kd * on_kd / (2.0 * math.sqrt(kp * on_kp))
    assert damping == pytest.approx({False: 1.2247, True: 1.0}, abs=1e-4)
