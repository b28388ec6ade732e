# SPDX-License-Identifier: Apache-2.0
"""Where the chunks of a study are run: in processes of this machine, or on a Dask cluster."""

from __future__ import annotations

import gc
import multiprocessing
import os
import signal
import threading
from abc import ABC, abstractmethod
from collections import deque
from collections.abc import Generator, Iterable
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from itertools import islice
from multiprocessing import connection
from multiprocessing.process import BaseProcess
from typing import Any

from fivebar_description.errors import InputError
from fivebar_description.interrupts import STOP_SIGNALS
from fivebar_studies.engine.chunks import Chunk, run_chunk

EACH = 4
"""Chunks under way for each process, so that none waits for its next one while an earlier chunk takes longer."""

TRIES = 3
"""Processes that may die of a chunk, until the study ends."""

DIED = "{}: the processes that ran them died: expected room for them; the finished cases are kept"


class Executor(ABC):
    """Runs chunks, as many at a time as it has processors for."""

    def stream(self, chunks: Iterable[Chunk]) -> Generator[str, None, None]:
        """Yield the rows of each chunk as lines, in order of the chunks.

        The chunks may be endless: they are drawn only as processors become free, and closing the iterator cancels those
        that have not begun.

        Raises:
            InputError: a chunk cannot be run.
        """
        coming = iter(chunks)
        under_way: deque[tuple[Chunk, Any]] = deque()
        try:
            while True:
                room = EACH * self._processors() - len(under_way)
                under_way.extend((chunk, self._submit(chunk)) for chunk in islice(coming, max(0, room)))
                if not under_way:
                    return
                yield self._rows(*under_way[0])
                under_way.popleft()
        finally:
            for _, future in under_way:
                future.cancel()

    @abstractmethod
    def _processors(self) -> int:
        """Return how many chunks can be run at a time."""

    @abstractmethod
    def _submit(self, chunk: Chunk) -> Any:
        """Begin a chunk, and return its future."""

    @abstractmethod
    def _rows(self, chunk: Chunk, future: Any) -> str:
        """Wait for the rows of a chunk, and run it again where the process that did has died."""


class LocalProcesses(Executor):
    """Processes of this machine, kept until it is left; fewer than two do everything in this one."""

    def __init__(self, workers: int) -> None:
        """Start with none: they come with the first chunks."""
        self._workers = workers
        self._pool: ProcessPoolExecutor | None = None
        self._others: set[BaseProcess] = set()

    def __enter__(self) -> LocalProcesses:
        """Return itself."""
        return self

    def __exit__(self, *error: Any) -> None:
        """End the processes, whatever they do."""
        if self._pool is not None:
            # the pool itself would wait for cancelled work
            for worker in set(multiprocessing.active_children()) - self._others:
                worker.kill()
            self._pool.shutdown(cancel_futures=True)
            self._pool = None

    def stream(self, chunks: Iterable[Chunk]) -> Generator[str, None, None]:
        """Yield the rows of each chunk as lines, in order of the chunks."""
        return super().stream(chunks) if self._workers > 1 else (run_chunk(chunk) for chunk in chunks)

    def _processors(self) -> int:
        return self._workers

    def _submit(self, chunk: Chunk) -> Future[str]:
        # a worker that this starts begins with the signals blocked, until it ignores them
        before = signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
        try:
            if self._pool is not None:
                try:
                    return self._pool.submit(run_chunk, chunk)
                except BrokenProcessPool:
                    self._pool.shutdown()
            # fresh: the progress bar has a thread, and a process with threads must not be forked
            context = multiprocessing.get_context("spawn")
            self._others = set(multiprocessing.active_children())
            self._pool = ProcessPoolExecutor(self._workers, context, _prepare_worker)
            return self._pool.submit(run_chunk, chunk)
        finally:
            signal.pthread_sigmask(signal.SIG_SETMASK, before)

    def _rows(self, chunk: Chunk, future: Future[str]) -> str:
        for _ in range(TRIES - 1):
            with suppress(BrokenProcessPool):
                return future.result()
            # all chunks of the pool are lost, and each is run again once its rows are asked for
            future = self._submit(chunk)
        try:
            return future.result()
        except BrokenProcessPool as error:
            raise InputError(DIED.format(chunk)) from error


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
