# SPDX-License-Identifier: Apache-2.0
"""Real-time priority, processors and locked memory of this process, as far as the system grants them."""

from __future__ import annotations

import ctypes
import gc
import os
import resource
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Annotated, NamedTuple

from fivebar_description.interface import HIGHEST_PRIORITY
from fivebar_description.settings import Setting


def processor_set(text: str) -> set[int]:
    """Return the processors that a list such as "0,2" names.

    Raises:
        ValueError: it is not a list of numbers with commas between them.
    """
    return {int(word) for word in text.split(",") if word.strip()}


def processors_problem(text: str) -> str | None:
    """Return what is wrong with the processors in a text, None for nothing."""
    try:
        valid = all(number >= 0 for number in processor_set(text))
    except ValueError:
        valid = False
    return None if valid else 'expected processor numbers with commas between them, such as "0,2"'


class Scheduling(NamedTuple):
    """Parameters that every node has; in a process of several nodes those of the last one count."""

    scheduling_priority: Annotated[
        int,
        Setting(
            "Priority under SCHED_FIFO of all threads of the process, 0 for ordinary scheduling. Needs the right to it"
            " (CAP_SYS_NICE, or rtprio in limits.conf); without it the node warns and continues. With it, memory is"
            " locked too where that is unlimited (CAP_IPC_LOCK, or memlock).",
            at_least=0,
            at_most=HIGHEST_PRIORITY,
        ),
    ] = 0
    processors: Annotated[
        str,
        Setting(
            'Processors that the process may use, such as "0,2"; empty for all. If the system refuses, the node warns.',
            check=processors_problem,
        ),
    ] = ""


def _threads() -> list[int]:
    return [int(path.name) for path in Path("/proc/self/task").iterdir()]


@contextmanager
def punctual(priority: int) -> Iterator[None]:
    """Run a block with a priority under SCHED_FIFO, where that is granted, and without garbage collection."""
    collected = gc.isenabled()
    gc.collect()
    gc.disable()
    apply_scheduling(Scheduling(priority), lambda words: None)
    try:
        yield
    finally:
        for thread in _threads():
            with suppress(OSError):
                os.sched_setscheduler(thread, os.SCHED_OTHER, os.sched_param(0))
        ctypes.CDLL(None).munlockall()
        if collected:
            gc.enable()


def spare_what_exists() -> None:
    """Exclude all objects of this process from garbage collection: a look at all of them takes up to 100 ms."""
    gc.collect()
    gc.freeze()


def apply_scheduling(scheduling: Scheduling, warn: Callable[[str], None]) -> None:
    """Put all threads of this process under a priority and onto processors; report what is refused to `warn`."""
    priority, processors = scheduling
    threads = _threads()
    if processors:
        try:
            for thread in threads:
                os.sched_setaffinity(thread, processor_set(processors))
        except OSError as error:
            warn(f"processors {processors} not granted ({error.strerror}): continuing with all")
    if priority:
        try:
            for thread in threads:
                os.sched_setscheduler(thread, os.SCHED_FIFO, os.sched_param(priority))
        except OSError as error:
            warn(f"scheduling_priority {priority} not granted ({error.strerror}): continuing with ordinary scheduling")
            return
        lock_memory()


MCL_CURRENT, MCL_FUTURE, MCL_ONFAULT = 1, 2, 4
"""Flags of mlockall, from <sys/mman.h>: what is mapped, what will be, and both only once it is used."""

CAP_IPC_LOCK = 1 << 14
"""In CapEff of /proc/self/status."""


def lock_memory() -> bool:
    """Keep the memory that this process uses from being swapped out; return whether the system grants it.

    Where the amount is limited, nothing is locked: what a process maps beyond the limit would be refused.
    """
    status = Path("/proc/self/status").read_text(encoding="ascii")
    capabilities = next(int(line.split()[1], 16) for line in status.splitlines() if line.startswith("CapEff:"))
    soft, _ = resource.getrlimit(resource.RLIMIT_MEMLOCK)
    if soft != resource.RLIM_INFINITY and not capabilities & CAP_IPC_LOCK:
        return False
    return bool(ctypes.CDLL(None).mlockall(MCL_CURRENT | MCL_FUTURE | MCL_ONFAULT) == 0)
