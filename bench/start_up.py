# SPDX-License-Identifier: Apache-2.0
"""Processor time in which commands answer, and in which a node has started."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.runs.domain import private_domain

REPEATS = 3
"""Number of starts, of which the shortest counts: the first may still have to compile modules."""

COMMAND = ("-m", "fivebar_bringup.cli.entry")

NODE = "fivebar_control.nodes.supervisor"

STARTED = b"waits for"
"""Part of the line that a node prints once it has started, alone in its domain."""


class StartUp(NamedTuple):
    """A program to start.

    Attributes:
        name: in words.
        arguments: of Python.
        target: processor time at most (s).
    """

    name: str
    arguments: tuple[str, ...]
    target: float


PROCESSES = (
    StartUp("fivebar --help", (*COMMAND, "--help"), 0.3),
    StartUp("fivebar --version", (*COMMAND, "--version"), 0.3),
    StartUp("a mistyped option", (*COMMAND, "simulate", "middle", "--no-pge"), 0.3),
    StartUp("import fivebar", ("-c", "import fivebar"), 0.4),
    StartUp("simulate unified_middle --no-page", (*COMMAND, "simulate", "unified_middle", "--no-page"), 1.3),
    StartUp("simulate unified_middle", (*COMMAND, "simulate", "unified_middle"), 3.0),
)


def start_up_rows() -> Iterator[tuple[str, str, str]]:
    """Yield what is started, its processor time and the target."""
    for process in PROCESSES:
        yield process.name, f"{processor_time(process.arguments):.2f} s", f"at most {process.target:g} s"
    yield "a node until it waits for the others", f"{node_time():.2f} s", "at most 0.7 s"


def processor_time(arguments: Sequence[str]) -> float:
    """Return the shortest processor time (s) of some runs of Python with these arguments, in an empty directory."""
    times = []
    for _ in range(REPEATS):
        with tempfile.TemporaryDirectory() as folder:
            process = subprocess.Popen(
                [sys.executable, *arguments], cwd=folder, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL
            )
            _, _, used = os.wait4(process.pid, 0)
            # it has been waited for
            process.returncode = 0
        times.append(used.ru_utime + used.ru_stime)
    return min(times)


def node_time() -> float:
    """Return the shortest processor time (s) of some starts of a node."""
    with private_domain() as domain:
        return min(_started(domain) for _ in range(REPEATS))


def _started(domain: int) -> float:
    process = subprocess.Popen(
        [sys.executable, "-m", NODE],
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    try:
        assert process.stderr is not None
        for line in process.stderr:
            if STARTED in line:
                return _processor_time_of(process.pid)
    finally:
        process.kill()
        process.wait()
    raise RuntimeError(f"{NODE} has ended before it was ready")


def _processor_time_of(pid: int) -> float:
    """Return the processor time (s) of a running process."""
    fields = Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")
