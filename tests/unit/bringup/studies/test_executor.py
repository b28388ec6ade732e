# SPDX-License-Identifier: Apache-2.0
"""Chunks shared among processes: in their order, taken as processes get free, given up at once, whoever dies."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Iterator
from contextlib import closing
from itertools import count, islice
from pathlib import Path

import pytest
from toy_study import TOY, ToySettings

from fivebar_description.errors import InputError
from fivebar_description.interrupts import STOP_SIGNALS
from fivebar_studies.engine.chunks import Chunk
from fivebar_studies.engine.executor import EACH, TRIES, LocalProcesses
from fivebar_studies.engine.running import run_study

SETTINGS = ToySettings().model_dump_json()


def chunks(numbers: Iterator[int] | range, settings: str = SETTINGS) -> Iterator[Chunk]:
    return (Chunk(TOY.place, settings, number, number + 1) for number in numbers)


@pytest.mark.parametrize("workers", [1, 2])
def test_an_endless_stream_is_taken_piece_by_piece_and_closed(workers: int) -> None:
    taken = []

    def numbers() -> Iterator[int]:
        for number in count():
            taken.append(number)
            yield number

    before = set(multiprocessing.active_children())
    with LocalProcesses(workers) as processes, closing(processes.stream(chunks(numbers()))) as coming:
        assert list(islice(coming, 7)) == [f"{number},1.0\n" for number in range(7)]
    assert len(taken) <= 7 + EACH * workers
    assert set(multiprocessing.active_children()) <= before


def test_workers_leave_signals_to_their_parent_from_their_start_on() -> None:
    """As a signal to the process group reaches them, perhaps while they load their modules."""
    before = set(multiprocessing.active_children())

    def numbers() -> Iterator[int]:
        for number in range(100):
            for worker in set(multiprocessing.active_children()) - before:
                for signal_number in STOP_SIGNALS:
                    os.kill(worker.pid or 0, signal_number)
            yield number

    with LocalProcesses(2) as processes:
        assert list(processes.stream(chunks(numbers()))) == [f"{number},1.0\n" for number in range(100)]


@pytest.mark.parametrize("workers", [1, 2])
def test_an_error_of_a_case_is_not_lost(workers: int) -> None:
    with LocalProcesses(workers) as processes, pytest.raises(ValueError, match="value"):
        list(processes.stream(chunks(range(3), '{"value": "none"}')))


def test_processes_are_kept_for_the_next_stream_also_after_one_that_was_not_taken_to_its_end() -> None:
    before = set(multiprocessing.active_children())
    with LocalProcesses(2) as processes:
        list(processes.stream(chunks(range(9))))
        kept = set(multiprocessing.active_children()) - before
        with closing(processes.stream(chunks(count()))) as coming:
            next(coming)
        list(processes.stream(chunks(range(9))))
        assert len(kept) == 2 and set(multiprocessing.active_children()) - before == kept
    assert set(multiprocessing.active_children()) <= before


def test_cases_whose_process_is_killed_are_run_again_or_named(tmp_path: Path) -> None:
    deaths = tmp_path / "deaths"
    deaths.mkdir()

    def csv(out: str, deadly: int) -> bytes:
        for number in range(deadly):
            (deaths / str(number)).touch()
        with LocalProcesses(2) as processes:
            run_study(TOY, {"cases": 20, "deaths": str(deaths)}, tmp_path / out, processes)
        return (tmp_path / out / "toy.csv").read_bytes()

    whole = csv("whole", 0)
    assert csv("killed", TRIES - 1) == whole
    with pytest.raises(InputError, match="cases 5 to 5: the processes that ran them died: expected room"):
        csv("hopeless", 99)
    kept = (tmp_path / "hopeless" / "toy.csv").read_bytes()
    assert kept == b"".join(whole.splitlines(keepends=True)[:6])
    for left in deaths.iterdir():
        left.unlink()
    assert csv("hopeless", 0) == whole
