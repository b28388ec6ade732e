# SPDX-License-Identifier: Apache-2.0
"""Libraries that come with an extra of the distribution, and may be missing."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Any

from fivebar_description.errors import InputError

CLONE = Path(__file__).parents[3]
"""The folder of the project, where its packages are installed from a clone."""


def library(name: str, extra: str = "data") -> Any:
    """Return a library of an extra.

    Raises:
        InputError: it is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise InputError(f"{name.partition('.')[0]} is not installed: {how_to_install(extra)}") from error


def how_to_install(extra: str, clone: Path = CLONE) -> str:
    """Return the command that installs an extra: in a clone its own target, elsewhere pip."""
    return "make extras" if (clone / "Makefile").is_file() else f"pip install 'fivebar[{extra}]'"
