"""Where the chunks of a study are run: in processes of this machine, or on a Dask cluster."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Protocol

from fivebar_bringup.studies.engine.chunks import Chunk, run_chunk
from fivebar_bringup.studies.engine.local import KeptProcesses


class Executor(Protocol):
    """Runs chunks, as many at a time as it has processors for."""

    def stream(self, chunks: Iterable[Chunk]) -> Generator[str, None, None]:
        """Yield the rows of chunks as lines, in order of completion.

        The chunks may be endless: they are drawn only as processors become free, and closing the iterator cancels what
        is still running.
        """


class LocalProcesses:
    """Processes of this machine, kept until it is left; fewer than two do everything in this one."""

    def __init__(self, workers: int) -> None:
        """Start with none: they come with the first chunks."""
        self._processes = KeptProcesses(workers)

    def __enter__(self) -> LocalProcesses:
        """Return itself."""
        return self

    def __exit__(self, *error: Any) -> None:
        """End the processes."""
        self._processes.__exit__(*error)

    def stream(self, chunks: Iterable[Chunk]) -> Generator[str, None, None]:
        """Yield the rows of chunks as lines, in order of completion."""
        return self._processes.stream(run_chunk, chunks)


@contextmanager
def executor_of(
    workers: int, scheduler: str | None, scheduler_file: Path | None, tell: Callable[[str], None]
) -> Iterator[Executor]:
    """Provide the cluster of a scheduler, or else processes of this machine.

    Args:
        workers: processes of this machine.
        scheduler, scheduler_file: address of a Dask scheduler, or the file that has it.
        tell: told of what is unusual, in one line.

    Raises:
        InputError: there is no such cluster, or Dask is not installed.
    """
    if scheduler is None and scheduler_file is None:
        with LocalProcesses(workers) as processes:
            yield processes
        return
    # here, because Dask is an extra
    from fivebar_bringup.studies.engine.cluster import cluster_of

    with cluster_of(scheduler, scheduler_file, tell) as cluster:
        yield cluster
