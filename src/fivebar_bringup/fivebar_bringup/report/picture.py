"""A finished picture of a report."""

from __future__ import annotations

from typing import NamedTuple


class Picture(NamedTuple):
    """A figure as PNG, the stem of its file name, and what it shows."""

    name: str
    caption: str
    png: bytes
