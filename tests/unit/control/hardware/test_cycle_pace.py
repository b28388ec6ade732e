# SPDX-License-Identifier: Apache-2.0
"""Cycles that are numbered by the clock."""

from __future__ import annotations

import pytest

from fivebar_control.hardware.cycle_pace import CycleCount

PERIOD = 0.002


@pytest.mark.parametrize(
    ("moments", "passed"),
    [
        # in periods: punctual; late by less than a period; after a stall; the first one late
        ([0.0, 1.0, 2.0, 3.0], [1, 1, 1, 1]),
        ([0.0, 1.0, 2.7, 3.0, 4.1], [1, 1, 1, 1, 1]),
        ([0.0, 1.0, 2.9, 3.1, 4.0, 6.0], [1, 1, 1, 1, 1, 2]),
        ([0.0, 1.0, 4.3, 5.0, 6.0], [1, 1, 3, 1, 1]),
        ([0.6, 1.0, 2.0, 4.05, 5.0], [1, 1, 1, 2, 1]),
        # a little early, and never two cycles of one number
        ([0.0, 0.9, 2.0, 3.0, 3.05, 4.0], [1, 1, 1, 1, 1, 1]),
    ],
)
def test_periods_in_which_the_machine_stood_still_count(moments: list[float], passed: list[int]) -> None:
    count = CycleCount(PERIOD)
    assert [count.passed(100.0 + PERIOD * moment) for moment in moments] == passed


def test_cycles_stay_in_step_with_the_clock() -> None:
    count, number = CycleCount(PERIOD), -1
    for tick in range(5000):
        if tick % 97 in (3, 4, 5):
            continue
        number += count.passed(PERIOD * (tick + 1.1 * (tick % 7) / 7.0))
        assert number == tick


def test_two_cycles_in_one_period_do_not_make_the_count_run_away() -> None:
    count, number = CycleCount(PERIOD), -1
    for tick in range(5000):
        # so late that the next one comes in the same period
        number += count.passed(PERIOD * (tick + (0.97 if tick % 50 == 30 else 0.0)))
        assert 0 <= number - tick <= 1
    assert number - tick == 1
