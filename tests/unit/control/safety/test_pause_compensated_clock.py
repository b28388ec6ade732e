"""Deadlines stand still while the process that watches them is paused, and only then."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.safety.pause_compensated_clock import PauseCompensatedClock


class Steady:
    """A clock that the test turns."""

    def __init__(self) -> None:
        self.now = 100.0

    def __call__(self) -> float:
        return self.now


def test_a_pause_counts_for_the_longest_step() -> None:
    steady = Steady()
    clock = PauseCompensatedClock(steady, 0.003)
    steady.now += 0.002
    assert clock.read() == pytest.approx(100.002)
    steady.now += 0.050
    assert clock.read() == pytest.approx(100.005)
    steady.now += 0.001
    assert clock.read() == pytest.approx(100.006)


@given(steps=st.lists(st.floats(0.0, 1.0), max_size=40), longest=st.floats(1e-4, 1.0))
def test_each_interval_counts_for_the_longest_step_at_most(steps: list[float], longest: float) -> None:
    steady = Steady()
    clock = PauseCompensatedClock(steady, longest)
    for step in steps:
        steady.now += step
        clock.read()
    assert clock.read() == pytest.approx(100.0 + sum(min(step, longest) for step in steps), abs=1e-9)
