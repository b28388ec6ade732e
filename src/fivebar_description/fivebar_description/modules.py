# SPDX-License-Identifier: Apache-2.0
"""Modules by name: the command that runs one, and the part of one that is named as MODULE:NAME."""

from __future__ import annotations

import re
import sys
import traceback
from collections.abc import Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from importlib import import_module
from pathlib import Path
from typing import Any

from fivebar_description.errors import InputError, unwrapped
from fivebar_description.optional import confirm_package

RUN_MODULE = "import sys; del sys.path[0]; import runpy; runpy.run_module({!r}, run_name='__main__', alter_sys=True)"
"""The effect of `python -P -m`, in words that Python 3.10 understands, too."""

PLACE = re.compile(r"[A-Za-z_][\w.]*:[A-Za-z_]\w*")
"""MODULE:NAME."""

_UNOPENED: ContextVar[bool] = ContextVar("modules_unopened", default=False)


@contextmanager
def modules_unopened() -> Iterator[None]:
    """Import no module of a law or sensor from elsewhere within the block; it is only named, and cannot be run.

    Whatever reads a scenario or a run without running it does so in this block: a file of somebody else's names the
    module, and importing a module runs its code.
    """
    token = _UNOPENED.set(True)
    try:
        yield
    finally:
        _UNOPENED.reset(token)


def is_unopened() -> bool:
    """Return whether modules from elsewhere are not to be imported here."""
    return _UNOPENED.get()


def module_command(module: str) -> list[str]:
    """Return the command that runs a module as `python -m` does, but never imports a json.py of the user's."""
    safe = hasattr(sys.flags, "safe_path")
    return [sys.executable, "-P", "-m", module] if safe else [sys.executable, "-c", RUN_MODULE.format(module)]


def load_part(place: str) -> Any:
    """Return what MODULE:NAME is, or the module where only that is given; it is imported.

    Raises:
        InputError: it cannot be imported, or its module fails while it is.
    """
    module, _, name = place.partition(":")
    confirm_package(place, place)
    try:
        loaded = import_module(module)
        return getattr(loaded, name) if name else loaded
    except (ImportError, AttributeError) as error:
        raise InputError(f"{place}: cannot be loaded: {error}") from error
    except Exception as error:
        raise InputError(f"{place}: cannot be loaded: {error_with_place(error)}") from error


def error_with_place(error: Exception) -> str:
    """Return what an error of somebody else's module is, and in which line, which a SyntaxError says by itself."""
    words = f"{type(error).__name__}: {unwrapped(error)}"
    if isinstance(error, SyntaxError):
        return words
    last = traceback.extract_tb(error.__traceback__)[-1]
    return f"{words} ({Path(last.filename).name}, line {last.lineno})"
