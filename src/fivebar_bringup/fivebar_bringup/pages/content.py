# SPDX-License-Identifier: Apache-2.0
"""The content of pages: pictures and tables."""

from __future__ import annotations

import base64
from collections.abc import Iterable, Sequence
from typing import Any, NamedTuple

LONG = 24
"""Entries with more characters are broken into lines."""


class Picture(NamedTuple):
    """A figure as PNG, the stem of its file name, and what it shows."""

    name: str
    caption: str
    png: bytes

    @property
    def base64(self) -> str:
        """The PNG as text, as a page embeds it."""
        return base64.b64encode(self.png).decode("ascii")


class Cell(NamedTuple):
    """An entry: as a person reads it, as a number or plain value, and whether it is good, bad or neither."""

    text: str
    value: Any
    good: bool | None = None

    @property
    def css_class(self) -> str | None:
        """How it looks on the page; None for an ordinary entry."""
        kinds = [] if self.good is None else ["good" if self.good else "bad"]
        kinds += ["long"] if len(self.text) > LONG else []
        return " ".join(kinds) or None


class Table(NamedTuple):
    """A table with its place on the page: name, title, what it shows, columns and rows."""

    name: str
    title: str
    note: str
    columns: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    folded: bool = False

    def as_json(self) -> dict[str, Any]:
        """Return the table as plain values."""
        rows = [dict(zip(self.columns, (cell.value for cell in row), strict=True)) for row in self.rows]
        return {"name": self.name, "title": self.title, "rows": rows}


Entry = Cell | str | int
"""An entry of a table: a text, and a number of things, stand for themselves."""

Line = Sequence[Entry]
"""A row of a table."""


def table(
    name: str,
    title: str,
    note: str,
    columns: Iterable[str],
    rows: Iterable[Line],
    folded: bool = False,
) -> Table:
    """Return a table of entries."""
    cells = (tuple(cell if isinstance(cell, Cell) else Cell(str(cell), cell) for cell in row) for row in rows)
    return Table(name, title, note, tuple(columns), tuple(cells), folded)
