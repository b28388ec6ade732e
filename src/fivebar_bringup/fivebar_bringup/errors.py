# SPDX-License-Identifier: Apache-2.0
"""Errors of runs and bags that a user reads, in a module that loads no library."""

from __future__ import annotations

from pathlib import Path

from fivebar_description.errors import printable


class BagError(Exception):
    """A bag cannot be read, or lacks the requested content: one line, `<path>: <what>`."""

    def __init__(self, path: Path, what: str) -> None:
        super().__init__(printable(f"{path}: {what}"))
