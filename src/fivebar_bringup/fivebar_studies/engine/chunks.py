# SPDX-License-Identifier: Apache-2.0
"""A chunk of cases as a task for another process or machine: plain data in, plain data out."""

from __future__ import annotations

import json
import os
import platform
import socket
import sys
import traceback
from functools import lru_cache
from importlib.metadata import version
from pathlib import Path
from typing import NamedTuple

from fivebar_control.compiling import processor
from fivebar_description.errors import InputError
from fivebar_description.modules import load_part

CACHE = "NUMBA_CACHE_DIR"

ROWS, REFUSED, FAILED, KIND, PROGRAM, HOST = "rows", "refused", "failed", "kind", "program", "host"
"""Keys of a worker's result: lines of rows, or why there are none in a line or as a traceback; what the worker is."""


class Chunk(NamedTuple):
    """Cases of a study.

    Attributes:
        study: where the study is defined, `MODULE:NAME`.
        settings: of the study, as JSON.
        first, end: numbers of the cases, from `first` to before `end`.
    """

    study: str
    settings: str
    first: int
    end: int

    def __str__(self) -> str:
        return f"cases {self.first} to {self.end - 1}"


def run_chunk(chunk: Chunk) -> str:
    """Return the rows of a chunk as lines of comma-separated values, in order of the cases."""
    study = load_part(chunk.study)
    settings = study.settings.model_validate_json(chunk.settings)
    rows = (row for number in range(chunk.first, chunk.end) for row in study.run(settings, number))
    lines: str = study.table.lines(rows)
    return lines


def run_on_worker(study: str, settings: str, first: int, end: int) -> str:
    """Return the rows of a chunk, or why there are none, and what the worker of a cluster is, as JSON."""
    keep_machine_code_apart()
    result: dict[str, object] = {HOST: socket.gethostname()}
    try:
        result |= {KIND: kind_of_machine(), PROGRAM: program_of(study, settings)}
        result[ROWS] = run_chunk(Chunk(study, settings, first, end))
    except InputError as error:
        result[REFUSED] = str(error)
    except Exception:
        # an exception would be pickled
        result[FAILED] = traceback.format_exc()
    return json.dumps(result)


@lru_cache(maxsize=8)
def program_of(study: str, settings: str) -> str:
    """Return the digest of what decides the rows of a chunk with this study and settings, found once in a process."""
    part = load_part(study)
    program: str = part.program(part.settings.model_validate_json(settings))
    return program


def keep_machine_code_apart() -> None:
    """Have this machine keep its machine code in a folder of its own, unless NUMBA_CACHE_DIR names one.

    The machines of a cluster share a home directory, on which locks are slow or do not work. The folder is the user's
    own, since what is in it is run.
    """
    if CACHE not in os.environ and "numba" not in sys.modules:
        cache = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache")
        os.environ[CACHE] = str(cache / "fivebar" / "numba" / socket.gethostname())


@lru_cache(maxsize=1)
def kind_of_machine() -> dict[str, str]:
    """Return what the last digits of results depend on besides the program."""
    libraries = {name: version(name) for name in ("numpy", "scipy", "numba", "llvmlite", "pin")}
    return {"python": platform.python_version(), "processor": processor(), **libraries}
