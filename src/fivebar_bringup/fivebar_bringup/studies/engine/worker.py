"""A chunk of cases on a worker of a cluster: what the worker is goes with its rows, all of it plain data."""

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

from fivebar_bringup.studies.engine.chunks import Chunk, program_of, run_chunk
from fivebar_control.compiling import processor
from fivebar_description.errors import InputError

CACHE = "NUMBA_CACHE_DIR"

ROWS, REFUSED, FAILED, KIND, PROGRAM, HOST = "rows", "refused", "failed", "kind", "program", "host"
"""Keys of a result: lines of rows, or why there are none in a line or as a traceback; what the worker is."""


def run_on_worker(study: str, settings: str, first: int, end: int) -> str:
    """Return the rows of a chunk, or why there are none, and what the worker is, as JSON."""
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
