"""Endless work shared among processes: taken as they get free, given up at once."""

from __future__ import annotations

import math
import multiprocessing
import os
from collections.abc import Iterator
from contextlib import closing
from itertools import count, islice

import pytest

from fivebar_bringup.studies.engine.local import KeptProcesses, in_turns
from fivebar_description.interrupts import STOP_SIGNALS


@pytest.mark.parametrize("workers", [1, 2])
def test_an_endless_stream_is_taken_piece_by_piece_and_closed(workers: int) -> None:
    taken = []

    def tasks() -> Iterator[int]:
        for number in count():
            taken.append(number)
            yield number

    before = set(multiprocessing.active_children())
    with KeptProcesses(workers) as processes, closing(processes.stream(math.factorial, tasks())) as coming:
        found = list(islice(coming, 7))
    assert len(found) == 7 and set(found) <= {math.factorial(number) for number in taken}
    # at most as many under way, and as many finished that nobody has asked for
    assert len(taken) <= 7 + 4 * workers
    assert set(multiprocessing.active_children()) <= before


def test_workers_leave_signals_to_their_parent_from_their_start_on() -> None:
    """As a signal to the process group reaches them, perhaps while they load their modules."""
    before = set(multiprocessing.active_children())
    numbers = iter(range(100))

    def tasks() -> Iterator[int]:
        for number in numbers:
            for worker in set(multiprocessing.active_children()) - before:
                for signal_number in STOP_SIGNALS:
                    os.kill(worker.pid or 0, signal_number)
            yield number

    with KeptProcesses(2) as processes:
        found = sorted(processes.stream(math.factorial, tasks()))
    assert found == [math.factorial(number) for number in range(100)]


@pytest.mark.parametrize("workers", [1, 2])
def test_all_of_a_finite_stream_comes_and_an_error_is_not_lost(workers: int) -> None:
    with KeptProcesses(workers) as processes:
        assert sorted(processes.stream(math.sqrt, [9.0, 4.0, 1.0])) == [1.0, 2.0, 3.0]
        with pytest.raises(ValueError, match=r"domain|nonnegative"):
            list(processes.stream(math.sqrt, [4.0, -1.0]))


def test_processes_are_kept_for_the_next_stream_and_end_with_one_that_is_cancelled() -> None:
    before = set(multiprocessing.active_children())
    with KeptProcesses(2) as processes:
        list(processes.stream(math.factorial, range(9)))
        kept = set(multiprocessing.active_children()) - before
        list(processes.stream(math.factorial, range(9)))
        assert len(kept) == 2 and set(multiprocessing.active_children()) - before == kept
        with closing(processes.stream(math.factorial, count())) as coming:
            next(coming)
        assert set(multiprocessing.active_children()) <= before
        list(processes.stream(math.factorial, range(9)))
    assert set(multiprocessing.active_children()) <= before


def test_each_case_begins_with_another_law_and_returns_all_in_their_order() -> None:
    laws, begun = tuple("abcdefg"), []
    for case in range(4):
        tried: list[str] = []
        assert in_turns(lambda law, tried=tried: (tried.append(law), law.upper())[1], laws, case) == list("ABCDEFG")
        begun.append(tried[0])
        assert sorted(tried) == list(laws)
    # the first two are half of all apart, so that two processes meet late
    assert begun == ["a", "e", "b", "f"]
    assert in_turns(str.upper, (), 3) == []
