# SPDX-License-Identifier: Apache-2.0
"""A Dask cluster as the executor of a study."""

from __future__ import annotations

import json
import warnings
from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from fivebar_bringup.extras import library
from fivebar_description.errors import InputError
from fivebar_description.stages import stage
from fivebar_studies.engine.chunks import FAILED, HOST, KIND, PROGRAM, REFUSED, ROWS, Chunk, program_of, run_on_worker
from fivebar_studies.engine.executor import DIED, Executor

CONNECT = 30.0
"""Time (s) within which a scheduler has to answer."""

PLAIN = ("msgpack", "error")
"""How results come back: as plain data. What else a message may hold, such as pickled objects, is not decoded."""


class DaskCluster(Executor):
    """The workers of a scheduler. It hands chunks of workers that die to others."""

    def __init__(self, client: Any, tell: Callable[[str], None]) -> None:
        """Use the workers of a `distributed.Client`; `tell` is told where they differ."""
        self._client, self._tell = client, tell
        self._kinds: dict[str, str] = {}

    def stream(self, chunks: Iterable[Chunk]) -> Generator[str, None, None]:
        """Yield the rows of each chunk as lines, in order of the chunks.

        Raises:
            InputError: the cluster has gone, a worker has another program, or it refuses its chunk.
        """
        distributed = library("distributed", "cluster")
        try:
            with stage("waiting for workers"):
                self._client.wait_for_workers(1)
            yield from super().stream(chunks)
        except (OSError, distributed.CancelledError) as error:
            raise InputError(f"the Dask cluster has gone: {error or 'its scheduler does not answer'}") from error

    def _processors(self) -> int:
        return max(1, sum(map(int, self._client.nthreads().values())))

    def _submit(self, chunk: Chunk) -> Any:
        return self._client.submit(run_on_worker, *chunk, pure=False)

    def _rows(self, chunk: Chunk, future: Any) -> str:
        with self._client.as_current():
            library("distributed", "cluster").wait(future)
        if future.status == "error":
            # the exception itself is pickled, and not looked at
            raise InputError(DIED.format(chunk))
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
def cluster_of(
    scheduler: str | None,
    scheduler_file: Path | None = None,
    tell: Callable[[str], None] = warnings.warn,
    security: Any = None,
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
