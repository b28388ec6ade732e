"""Libraries that come with an extra of the distribution, and may be missing."""

from __future__ import annotations

from importlib import import_module
from typing import Any

from fivebar_description.errors import InputError


def library(name: str, extra: str = "data") -> Any:
    """Return a library of an extra.

    Raises:
        InputError: it is not installed.
    """
    try:
        return import_module(name)
    except ImportError as error:
        raise InputError(f"{name.partition('.')[0]} is not installed: pip install 'fivebar[{extra}]'") from error
