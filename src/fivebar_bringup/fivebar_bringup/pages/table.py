"""Tables of a page, as numbers and as words."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from typing import Any, NamedTuple

LONG = 24
"""Entries with more characters are broken into lines."""

TABLE_CSS = """
.good { color: var(--good); }
.bad { color: var(--bad); }
.dense td, .dense th { padding: .3rem .55rem; font-size: .84rem; white-space: nowrap; }
.dense td.long { white-space: normal; min-width: 12rem; }
.note { color: var(--soft); }
details { margin: .9rem 0; }
summary { cursor: pointer; font-weight: 600; padding: .3rem 0; }
"""
"""What a page with tables needs besides what all pages have."""

WIDE_TABLE_CSS = TABLE_CSS + "\nmain { max-width: 1240px; }\n"
"""The same where the tables have many columns."""


class Cell(NamedTuple):
    """An entry: as a person reads it, as a number or plain value, and whether it is good, bad or neither."""

    text: str
    value: Any
    good: bool | None = None


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


def table_html(table: Table) -> str:
    """Return a table with its title; a folded one shows only that until it is opened."""
    inner = framed_rows(table.columns, ("".join(_cell(cell) for cell in row) for row in table.rows), "scroll dense")
    if table.folded:
        return f"<details><summary>{escape(table.title)}</summary>{inner}</details>\n"
    note = f'<p class="note">{escape(table.note)}</p>' if table.note else ""
    return f"<h3>{escape(table.title)}</h3>{note}{inner}\n"


def _cell(cell: Cell) -> str:
    kinds = [kind for kind, holds in (("good", cell.good is True), ("bad", cell.good is False)) if holds]
    kinds += ["long"] if len(cell.text) > LONG else []
    attribute = f' class="{" ".join(kinds)}"' if kinds else ""
    return f"<td{attribute}>{escape(cell.text)}</td>"


def plain_table(columns: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table of texts."""
    return framed_rows(columns, ("".join(f"<td>{escape(text)}</td>" for text in row) for row in rows))


def framed_rows(columns: Iterable[str], rows: Iterable[str], kind: str = "scroll") -> str:
    """Return a table from the titles of its columns and the HTML of each row's cells, in a box that scrolls."""
    head = "".join(f'<th scope="col">{escape(column)}</th>' for column in columns)
    body = "\n".join(f"<tr>{row}</tr>" for row in rows)
    return f'<div class="{kind}"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}\n</tbody>\n</table></div>'
