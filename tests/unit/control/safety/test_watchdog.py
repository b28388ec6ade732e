# SPDX-License-Identifier: Apache-2.0
"""The watchdog over joint states and candidates, with times that the test gives, and its clock."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_control.safety.watchdog import LONGEST_QUEUE, RECENT, PauseCompensatedClock, Watchdog


def test_a_sample_is_overdue_from_its_first_arrival_on() -> None:
    watch = Watchdog(0.02, math.inf, None)
    watch.received(0, 10.0)
    watch.received(0, 10.015)
    assert watch.overdue(10.0199) is None
    assert watch.overdue(10.0201) == 0
    watch.received(1, 10.018)
    watch.answered(0)
    assert watch.overdue(10.037) is None
    assert watch.overdue(10.0381) == 1
    assert str(watch.missing(1, ["ctc/torque"])) == "candidate_missing: no ctc/torque for sample 1 within 20 ms"


def test_the_oldest_overdue_sample_is_named() -> None:
    watch = Watchdog(0.02, math.inf, None)
    for sample in range(5):
        watch.received(sample, 1.0 + 0.001 * sample)
    assert watch.overdue(2.0) == 0
    watch.completed(2, 2.0)
    assert watch.overdue(2.0) == 3


def test_states_are_stale_once_the_run_has_begun_and_until_its_last_sample() -> None:
    watch = Watchdog(0.02, 0.03, 100)
    watch.received(0, 1.0)
    assert watch.stale(9.0) is None
    watch.received(1, 9.0)
    assert watch.stale(9.0299) is None
    assert str(watch.stale(9.0301)) == "state_stale: no joint states after sample 1 within 30 ms"
    watch.rearm(9.5)
    assert watch.stale(9.52) is None
    assert watch.stale(9.54) is not None
    watch.received(99, 10.0)
    assert watch.stale(10.04) is not None
    watch.received(100, 10.05)
    assert watch.stale(99.0) is None
    watch.begin_run()
    assert watch.stale(999.0) is None


def test_a_deadline_has_expired_when_it_is_reached() -> None:
    """Times and deadlines that a float holds exactly."""
    watch = Watchdog(0.25, 0.5, None)
    assert watch.newest == 0
    watch.completed(0, 1.0)
    watch.received(1, 1.0)
    assert watch.overdue(1.25) == 1
    assert watch.stale(1.5) is not None
    assert watch.obstacle(1.25) is not None


def test_a_run_without_end_is_watched_for_ever() -> None:
    watch = Watchdog(0.02, 0.03, None)
    watch.received(10**9, 1.0)
    assert watch.stale(1.04) is not None


def test_a_reset_wants_a_complete_sample_of_late() -> None:
    watch = Watchdog(0.02, 0.03, None)
    assert watch.obstacle(5.0) == "no sample has been complete for 200 ms"
    watch.completed(3, 5.0)
    assert watch.obstacle(5.0 + 0.9 * RECENT) is None
    assert watch.obstacle(5.0 + 1.1 * RECENT) is not None
    assert Watchdog(2.0, math.inf, None).obstacle(5.0) == "no sample has been complete for 2000 ms"


def test_samples_that_are_never_completed_do_not_pile_up() -> None:
    watch = Watchdog(1.0, math.inf, None)
    for sample in range(1000):
        watch.received(sample, 0.01 * sample)
    assert watch.overdue(99.0) == 1000 - LONGEST_QUEUE


def test_who_joins_in_the_middle_of_a_run_stops_it() -> None:
    watch = Watchdog(0.02, 0.03, None)
    assert str(watch.joined_late(17)) == "joined_late: the first sample heard was 17, not the beginning of a run"
    assert watch.joined_late(18) is None
    for first, late in ((0, False), (1, False), (2, True)):
        assert (Watchdog(0.02, 0.03, None).joined_late(first) is not None) == late, first
    assert Watchdog(0.02, math.inf, None).joined_late(17) is None, "where time waits nothing has moved"


def test_in_real_time_sample_0_is_repeated_until_it_is_answered() -> None:
    watch = Watchdog(0.02, 0.03, None)
    watch.received(0, 1.0)
    assert watch.overdue(9.0) is None
    watch.received(1, 9.0)
    assert watch.overdue(9.0201) == 1


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
