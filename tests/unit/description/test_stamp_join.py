# SPDX-License-Identifier: Apache-2.0
"""Joining by sample: what is new, repeated, old, or a leap that one wrong stamp must not cause."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fivebar_description.ros.sampling_node import CAPACITY, LEAP, Arrival, Contradicted, StampJoin


def answered(sample: int) -> StampJoin:
    join = StampJoin(["a"])
    assert join.put("a", sample, None) == (None,)
    return join


def test_the_first_message_may_be_of_any_sample() -> None:
    assert StampJoin(["a"]).arrival(10 * LEAP) is Arrival.NEW


def test_one_far_stamp_changes_nothing() -> None:
    join = answered(7)
    assert join.arrival(7 + LEAP + 1) is Arrival.LEAP
    assert join.arrival(8) is Arrival.NEW
    assert join.arrival(7) is Arrival.REPEATED
    assert join.arrival(6) is Arrival.OLD


def test_two_far_stamps_in_a_row_are_believed() -> None:
    join = answered(7)
    assert join.arrival(7 + 2 * LEAP) is Arrival.LEAP
    assert join.arrival(8 + 2 * LEAP) is Arrival.NEW


@given(first=st.integers(LEAP + 1, 10**9), step=st.integers(CAPACITY + 1, 10**9))
def test_scattered_far_stamps_are_never_believed(first: int, step: int) -> None:
    join = answered(0)
    assert [join.arrival(first + number * step) for number in range(4)] == [Arrival.LEAP] * 4
    assert join.arrival(1) is Arrival.NEW


@given(capacity=st.integers(1, 60), count=st.integers(0, 100))
def test_as_many_samples_wait_as_there_is_room_for(capacity: int, count: int) -> None:
    join = StampJoin(["a", "b"], capacity)
    for sample in range(count):
        assert join.put("a", sample, sample) is None
    kept = min(count, capacity)
    assert (join.waiting("a"), join.waiting("b")) == (0, kept)
    answers = [join.put("b", sample, -sample) for sample in range(count - kept, count)]
    assert answers == [(sample, -sample) for sample in range(count - kept, count)]


def test_the_first_value_of_a_sample_counts() -> None:
    join = StampJoin(["a", "b"])
    nan = float("nan")
    assert join.put("a", 3, (1.0, nan)) is None
    assert join.put("a", 3, (1.0, float("nan"))) is None
    with pytest.raises(Contradicted):
        join.put("a", 3, (2.0, nan))
    assert join.put("b", 3, 5.0) == ((1.0, nan), 5.0)
    assert join.repeats("b", 5.0)
    assert not join.repeats("b", 6.0)
    join.restart()
    assert join.put("a", 3, (2.0, nan)) is None
    assert join.repeats("b", 6.0)


def test_what_is_not_complete_can_be_forgotten() -> None:
    join = StampJoin(["a", "b"])
    assert join.put("a", 3, 1.0) is None
    join.forget()
    assert join.put("a", 3, 2.0) is None
    assert join.put("b", 3, 5.0) == (2.0, 5.0)
    assert join.last == 3
