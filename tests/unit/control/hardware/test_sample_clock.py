# SPDX-License-Identifier: Apache-2.0
"""Samples by the board's clock: jitter changes nothing, what was lost is counted, and two clocks may drift."""

from __future__ import annotations

from hypothesis import given
from hypothesis import strategies as st

from fivebar_motkin.sample_clock import WRAP_US, SampleClock

PERIOD = 2000


@given(st.lists(st.integers(-500, 500), min_size=1, max_size=200), st.integers(0, WRAP_US - 1))
def test_jitter_changes_nothing(jitters: list[int], start: int) -> None:
    clock = SampleClock(PERIOD)
    assert clock.periods(start) == 1
    moments = [(start + PERIOD * number + jitter) % WRAP_US for number, jitter in enumerate(jitters, 1)]
    assert [clock.periods(moment) for moment in moments] == [1] * len(moments)


def test_what_was_lost_is_counted_and_what_comes_at_once_is_no_sample() -> None:
    clock = SampleClock(PERIOD)
    moments = (0, 2000, 12_000, 12_100, 14_000, 16_000)
    assert [clock.periods(moment) for moment in moments] == [1, 1, 5, 0, 1, 1]
    clock.begin()
    assert clock.periods(500_000) == 1


def test_a_clock_that_drifts_is_followed() -> None:
    clock = SampleClock(PERIOD)
    # 100 ppm are a period in 20 s
    assert {clock.periods(round(number * PERIOD * 1.0001)) for number in range(30_000)} == {1}
