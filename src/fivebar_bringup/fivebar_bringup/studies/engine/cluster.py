"""A Dask cluster as the executor of a study."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from itertools import islice
from pathlib import Path
from typing import Any

from fivebar_bringup.extras import library
from fivebar_bringup.studies.engine.chunks import Chunk, program_of
from fivebar_bringup.studies.engine.worker import FAILED, HOST, KIND, PROGRAM, REFUSED, ROWS, run_on_worker
from fivebar_description.errors import InputError
from fivebar_description.stages import stage

CONNECT = 30.0
"""Time (s) within which a scheduler has to answer."""

EACH = 2
"""Chunks under way for each thread of the workers, so that none waits for its next one."""

PLAIN = ("msgpack", "error")
"""How results come back: as plain data. What else a message may hold, such as pickled objects, is not decoded."""


class DaskCluster:
    """The workers of a scheduler. It hands chunks of workers that die to others."""

    def __init__(self, client: Any, tell: Callable[[str], None]) -> None:
        """Use the workers of a `distributed.Client`; `tell` is told where they differ."""
        self._client, self._tell = client, tell
        self._kinds: dict[str, str] = {}

    def stream(self, chunks: Iterable[Chunk]) -> Generator[str, None, None]:
        """Yield the rows of chunks as lines, in order of completion.

        Raises:
            InputError: the cluster has gone, a worker has another program, or it refuses its chunk.
        """
        distributed = library("distributed", "cluster")
        coming = iter(chunks)
        under_way: set[Any] = set()
        with stage("waiting for workers, which compile machine code where it is new"):
            self._client.wait_for_workers(1)
        try:
            while True:
                room = EACH * max(1, sum(self._client.nthreads().values())) - len(under_way)
                under_way |= {self._submit(chunk) for chunk in islice(coming, max(0, room))}
                if not under_way:
                    return
                with self._client.as_current():
                    finished = distributed.wait(under_way, return_when="FIRST_COMPLETED").done
                under_way -= finished
                for future in finished:
                    yield self._rows(future)
        except (OSError, distributed.CancelledError) as error:
            raise InputError(f"the Dask cluster has gone: {error or 'its scheduler does not answer'}") from error
        finally:
            if self._client.status == "running":
                self._client.cancel(list(under_way))

    def _submit(self, chunk: Chunk) -> Any:
        future = self._client.submit(run_on_worker, *chunk, pure=False)
        future.chunk = chunk
        return future

    def _rows(self, future: Any) -> str:
        chunk: Chunk = future.chunk
        if future.status == "error":
            # the exception itself is pickled, and not looked at
            raise InputError(
                f"cases {chunk.first} to {chunk.end - 1}: the workers that ran them died: expected room for them; the"
                " finished cases are kept"
            )
        result = json.loads(future.result())
        if FAILED in result:
            raise RuntimeError(f"{result[HOST]}: {result[FAILED]}")
        if REFUSED in result:
            raise InputError(f"{result[HOST]}: {result[REFUSED]}")
        if result[PROGRAM] != program_of(chunk.study, chunk.settings):
            raise InputError(f"{result[HOST]}: has another version of the project or of a law than this machine")
        self._compare(result[HOST], result[KIND])
        rows: str = result[ROWS]
        return rows

    def _compare(self, host: str, kind: dict[str, str]) -> None:
        """Tell where a worker is of another kind than those before; each difference once."""
        for name, value in kind.items():
            usual = self._kinds.setdefault(name, value)
            if value != usual and f"{name} {value}" not in self._kinds:
                self._kinds[f"{name} {value}"] = value
                self._tell(f"{host}: {name} {value}, elsewhere {usual}: rows may differ in their last digits")


@contextmanager
def cluster_like(client: Any) -> Iterator[DaskCluster]:
    """Provide the cluster of a `distributed.Client`, by a client that decodes no pickled objects.

    Raises:
        InputError: it is no such client, or its scheduler does not answer.
    """
    distributed = library("distributed", "cluster")
    if not isinstance(client, distributed.Client):
        raise InputError(f"executor: {client!r}: expected a number of processes or a distributed.Client")
    with cluster_of(client.scheduler.address, None, _warn, client.security) as cluster:
        yield cluster


def _warn(words: str) -> None:
    warnings.warn(words, stacklevel=2)


@contextmanager
def cluster_of(
    scheduler: str | None, scheduler_file: Path | None, tell: Callable[[str], None], security: Any = None
) -> Iterator[DaskCluster]:
    """Provide the cluster of a scheduler, by its address or its file; TLS is as given, or as Dask is configured.

    Raises:
        InputError: it cannot be reached, or Dask is not installed.
    """
    distributed = library("distributed", "cluster")
    option, place = ("--scheduler", scheduler) if scheduler_file is None else ("--scheduler-file", str(scheduler_file))
    if scheduler is not None and scheduler_file is not None:
        raise InputError("--scheduler-file: expected either --scheduler or --scheduler-file")
    if scheduler_file is not None and not scheduler_file.is_file():
        raise InputError(f"--scheduler-file: {scheduler_file}: is no file")
    where = {"address": scheduler} if scheduler_file is None else {"scheduler_file": str(scheduler_file)}
    try:
        client = distributed.Client(
            **where, timeout=CONNECT, set_as_default=False, security=security, deserializers=PLAIN
        )
    except (OSError, ValueError, TypeError) as error:
        raise InputError(f"{option}: {place}: no Dask scheduler answers: {error}") from error
    with client:
        yield DaskCluster(client, tell)
