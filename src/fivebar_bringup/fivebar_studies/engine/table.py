# SPDX-License-Identifier: Apache-2.0
"""A table of rows of one class, as CSV, as Parquet, as a DataFrame, and with a schema."""

from __future__ import annotations

import csv
import io
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import NoneType
from typing import Any, Generic, TypeVar, get_args, get_type_hints

from fivebar_bringup.attributes import attribute_words
from fivebar_bringup.extras import library
from fivebar_description.errors import InputError

Row = TypeVar("Row", bound=tuple[Any, ...])

WORDS = {int: "integer", float: "number", bool: "boolean", str: "string"}
"""Types of columns, as a Table Schema calls them."""


EXPECTED = {int: "a whole number", float: "a number", bool: "0 or 1", str: "a text"}
"""The same in messages."""


def _flag(entry: str) -> bool:
    return bool(int(entry))


def _anything(row: Any) -> None:
    """Refuse no row."""


@dataclass(frozen=True)
class RowTable(Generic[Row]):
    """The table of a NamedTuple class whose fields are numbers, texts and flags, or None.

    Attributes:
        kind: the class.
        check: raises a ValueError for a row that has the right types and yet is none.
    """

    kind: type[Row]
    check: Callable[[Row], None] = _anything

    @cached_property
    def columns(self) -> dict[str, tuple[type, bool]]:
        """Type of each column by name, and whether an entry may be missing."""
        hints = get_type_hints(self.kind)
        names: tuple[str, ...] = getattr(self.kind, "_fields", ())
        kinds = {name: get_args(hints[name]) or (hints[name],) for name in names}
        return {name: (types[0], NoneType in types) for name, types in kinds.items()}

    @property
    def head(self) -> str:
        """First line of a file."""
        return ",".join(self.columns) + "\n"

    def lines(self, rows: Iterable[Row]) -> str:
        """Return rows as lines of comma-separated values; numbers keep all their digits."""
        text = io.StringIO()
        writer = csv.writer(text, lineterminator="\n")
        for row in rows:
            writer.writerow([_entry(value) for value in row])
        return text.getvalue()

    def read(self, text: str, first: int = 2) -> list[Row]:
        """Return the rows of whole lines, of which the first one is line `first` of its file.

        Raises:
            ValueError: a line is not a row; the text has its number.
        """
        try:
            lines = list(csv.reader(io.StringIO(text)))
        except csv.Error as error:
            raise ValueError(str(error)) from error
        rows = []
        for number, line in enumerate(lines, start=first):
            try:
                rows.append(self._row(line))
            except ValueError as error:
                raise ValueError(f"line {number}: {error}") from error
        return rows

    def _row(self, line: Sequence[str]) -> Row:
        if len(line) != len(self._readers):
            raise ValueError(f"{','.join(line)!r}: expected {len(self._readers)} entries")
        try:
            row = self.kind(*(reader(entry) for reader, entry in zip(self._readers, line, strict=True)))
        except ValueError as error:
            raise ValueError(self._unreadable(line)) from error
        self.check(row)
        return row

    def _unreadable(self, line: Sequence[str]) -> str:
        """Return which entry of a line has another type than its column."""
        for (name, (kind, _)), reader, entry in zip(self.columns.items(), self._readers, line, strict=True):
            try:
                reader(entry)
            except ValueError:
                return f"{name}: {entry!r}: expected {EXPECTED[kind]}"
        return ",".join(line)

    @cached_property
    def _readers(self) -> list[Callable[[str], Any]]:
        return [_reader(kind, missing) for kind, missing in self.columns.values()]

    def schema(self) -> dict[str, Any]:
        """Return the columns as a Table Schema (frictionless.dev): name, type and description of each."""
        described = attribute_words(self.kind)
        fields = [
            {"name": name, "type": WORDS[kind], "description": described.get(name, "")}
            for name, (kind, _) in self.columns.items()
        ]
        return {"fields": fields, "missingValues": [""]}

    def frame(self, rows: Sequence[Row]) -> Any:
        """Return rows as a `pandas.DataFrame`, whose `attrs["descriptions"]` has what each column is.

        Raises:
            InputError: pandas is not installed.
        """
        frame = library("pandas").DataFrame.from_records(rows, columns=list(self.columns))
        frame.attrs["descriptions"] = attribute_words(self.kind)
        return frame

    def parquet(self, rows: Sequence[Row]) -> bytes | None:
        """Return rows as the content of a Parquet file, None where pyarrow is not installed."""
        try:
            arrow, parquet = library("pyarrow"), library("pyarrow.parquet")
        except InputError:
            return None
        types = {int: arrow.int64(), float: arrow.float64(), bool: arrow.bool_(), str: arrow.string()}
        described = attribute_words(self.kind)
        fields = [
            arrow.field(name, types[kind], metadata={"description": described.get(name, "")})
            for name, (kind, _) in self.columns.items()
        ]
        columns = [[row[place] for row in rows] for place in range(len(fields))]
        content = io.BytesIO()
        parquet.write_table(arrow.table(columns, schema=arrow.schema(fields)), content)
        return content.getvalue()


def _entry(value: Any) -> Any:
    if value is None:
        return ""
    return int(value) if isinstance(value, bool) else value


def _reader(kind: type, missing: bool) -> Callable[[str], Any]:
    reader: Callable[[str], Any] = _flag if kind is bool else kind
    return (lambda entry: reader(entry) if entry else None) if missing else reader
