# SPDX-License-Identifier: Apache-2.0
"""Angles and counters without the whole turns by which other programs wrap or offset them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_description.whole_turns import continuous, counter_change, nearest_turn, same_turn


@pytest.mark.parametrize("turns", [-3, -1, 1, 2])
def test_whole_turns_are_taken_off(turns: int) -> None:
    assert same_turn(3.0 + turns * math.tau, 3.1) == pytest.approx(3.0, abs=1e-12)


@pytest.mark.parametrize(
    ("angle", "near"),
    [(0.1, 0.3), (3.0, -1.0), (5.0, 0.0), (9.0, 0.0), (1e100, 0.0), (math.inf, 0.0), (1.0, math.nan)],
)
def test_what_is_no_whole_turn_apart_stays_bit_for_bit(angle: float, near: float) -> None:
    assert same_turn(angle, near) == angle


@pytest.mark.parametrize(("near", "turn"), [(0.0, 0), (3.0, 0), (3.2, 1), (-3.2, -1), (40.0, 6), (math.nan, 0)])
def test_an_angle_is_put_on_the_nearest_turn(near: float, turn: int) -> None:
    assert nearest_turn(0.0, near) == turn * math.tau


def test_wrapped_columns_are_continuous_again_and_others_untouched() -> None:
    smooth = np.stack([np.linspace(2.0, 15.0, 400), np.linspace(1.0, -9.0, 400)], axis=1)
    wrapped = np.remainder(smooth + math.pi, math.tau) - math.pi
    assert continuous(wrapped) == pytest.approx(smooth, abs=1e-12)
    assert continuous(smooth) is smooth


def test_angles_that_are_not_known_are_passed_over() -> None:
    followed = continuous(np.array([[3.1], [math.nan], [-3.1], [-3.0]]))
    assert followed[[0, 2, 3], 0] == pytest.approx([3.1, math.tau - 3.1, math.tau - 3.0])
    assert math.isnan(followed[1, 0])


@pytest.mark.parametrize(
    ("before", "now", "change"),
    [(5, 12, 7), (2**31 - 1, -(2**31), 1), (-(2**31), 2**31 - 1, -1), (2**32 + 5, 2, -3)],
)
def test_a_counter_that_wraps_has_hardly_moved(before: int, now: int, change: int) -> None:
    assert counter_change(before, now) == change
