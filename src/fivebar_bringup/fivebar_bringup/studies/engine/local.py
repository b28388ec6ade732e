"""Runs independent tasks in this process or in a pool of processes."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, Future, ProcessPoolExecutor, as_completed, wait
from contextlib import AbstractContextManager, contextmanager
from itertools import islice
from multiprocessing import connection
from typing import Any, TypeVar

from fivebar_description.interrupts import STOP_SIGNALS
from fivebar_description.stages import stage

Input = TypeVar("Input")
Output = TypeVar("Output")


STARTING = "starting processes, which compile machine code where it is new"

GOLDEN = 0.5 * (5.0**0.5 - 1.0)


def share(
    function: Callable[[Input], Output],
    tasks: Sequence[Input],
    workers: int,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[Output]:
    """Apply a function to every task and return the results in the order of the tasks.

    Args:
        function: a module's own function; with several workers it and the tasks have to be picklable.
        tasks: begun in this order, so that the longest should come first.
        workers: processes to use; fewer than two do everything in this one.
        progress: called with the number of finished tasks and of all.
    """
    progress(0, len(tasks))
    if workers < 2:
        results = []
        for task in tasks:
            results.append(function(task))
            progress(len(results), len(tasks))
        return results
    with _pool(workers) as pool:
        futures = [_submit(pool, function, task) for task in tasks]
        for done, future in enumerate(_told(as_completed(futures)), start=1):
            future.result()
            progress(done, len(tasks))
        return [future.result() for future in futures]


class KeptProcesses:
    """Processes that go from one list of tasks to the next, with what they have loaded and compiled."""

    def __init__(self, workers: int) -> None:
        """Start with none: they come with the first tasks; fewer than two do everything in this process."""
        self.workers = workers
        self._kept: AbstractContextManager[ProcessPoolExecutor] | None = None
        self._pool: ProcessPoolExecutor | None = None

    def __enter__(self) -> KeptProcesses:
        """Return itself."""
        return self

    def __exit__(self, *error: Any) -> None:
        """End the processes."""
        kept, self._kept, self._pool = self._kept, None, None
        if kept is not None:
            kept.__exit__(*error)

    def stream(self, function: Callable[[Input], Output], tasks: Iterable[Input]) -> Generator[Output, None, None]:
        """Yield the results of a function on tasks in order of completion; tasks are drawn as processes become free.

        The tasks may be endless: closing the iterator cancels what is still running, and ends the processes.

        Args:
            function: a module's own function; with several workers it and the tasks have to be picklable.
            tasks: begun in this order.
        """
        if self.workers < 2:
            yield from map(function, tasks)
            return
        if self._pool is None:
            self._kept = _pool(self.workers)
            self._pool = self._kept.__enter__()
        try:
            yield from _told(_streamed(function, iter(tasks), self.workers, self._pool))
        except BaseException:
            self.__exit__(*sys.exc_info())
            raise


def _streamed(
    function: Callable[[Input], Output], coming: Iterator[Input], workers: int, pool: ProcessPoolExecutor
) -> Iterator[Output]:
    # one more each, so that no process waits for its next task
    under_way: set[Future[Output]] = {_submit(pool, function, task) for task in islice(coming, 2 * workers)}
    while under_way:
        finished, under_way = wait(under_way, return_when=FIRST_COMPLETED)
        under_way |= {_submit(pool, function, task) for task in islice(coming, len(finished))}
        for future in finished:
            yield future.result()


def _told(results: Iterator[Output]) -> Iterator[Output]:
    """Yield results, and tell until the first one comes why that takes long."""
    with stage(STARTING):
        first = list(islice(results, 1))
    yield from first
    yield from results


@contextmanager
def _pool(workers: int) -> Iterator[ProcessPoolExecutor]:
    """Provide a pool of fresh processes, which are terminated when the work is cancelled."""
    # fresh: the progress bar has a thread, and a process with threads must not be forked
    context = multiprocessing.get_context("spawn")
    others = set(multiprocessing.active_children())
    with ProcessPoolExecutor(workers, mp_context=context, initializer=_prepare_worker) as pool:
        try:
            yield pool
        except BaseException:
            # the pool itself would wait for cancelled work
            for worker in set(multiprocessing.active_children()) - others:
                worker.kill()
            raise


def _submit(pool: ProcessPoolExecutor, function: Callable[[Input], Output], task: Input) -> Future[Output]:
    """Submit a task; a worker that this starts begins with the signals blocked, until it ignores them."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
    try:
        return pool.submit(function, task)
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _prepare_worker() -> None:
    """Leave signals to the parent, end with it, and collect garbage rarely: runs make many small tuples, no cycles."""
    for number in STOP_SIGNALS:
        signal.signal(number, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)
    gc.set_threshold(200_000)
    threading.Thread(target=_end_with_parent, name="parent", daemon=True).start()


def _end_with_parent() -> None:
    """End this worker with its parent: a killed parent cannot, and the worker would wait forever."""
    parent = multiprocessing.parent_process()
    if parent is not None:
        connection.wait([parent.sentinel])
        os._exit(1)


def in_turns(function: Callable[[Input], Output], items: Sequence[Input], case: int) -> list[Output]:
    """Return the results of a function for all items, in their order.

    Each case begins with another item. What takes long the first time, such as the compilation of a law's loop, is then
    done by several processes at once. Multiples of the golden ratio keep the beginnings of successive cases apart.
    """
    first = int((case * GOLDEN) % 1.0 * len(items))
    results = {place: function(items[place]) for place in (*range(first, len(items)), *range(first))}
    return [results[place] for place in range(len(items))]
