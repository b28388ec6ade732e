# SPDX-License-Identifier: Apache-2.0
"""Definition of a study: a table of numbered cases, a function from a case to its rows, and a page of all rows."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Generic, NamedTuple, TypeVar

from fivebar_bringup.pages.content import Picture
from fivebar_description.strict_yaml import StrictModel, validate
from fivebar_studies.engine.table import Row, RowTable


class StudySettings(StrictModel):
    """The settings that determine the rows of a study; every field has a default."""

    def options(self, *names: str) -> list[str]:
        """Return the options of a command for lists of words, those left out that are the default."""
        words_of = ((name, getattr(self, name)) for name in names)
        fields = type(self).model_fields
        return [f"--{name} {','.join(words)}" for name, words in words_of if words != fields[name].default]


Settings = TypeVar("Settings", bound=StudySettings)


class StudyReport(NamedTuple):
    """The report of a study on its rows.

    Attributes:
        page: to look at, as HTML.
        content: all results as plain values, for NAME.json.
        pictures: of the page.
        shown: what its command prints.
        others: further files, text by name.
    """

    page: str
    content: Mapping[str, Any]
    pictures: Sequence[Picture]
    shown: Any = None
    others: Mapping[str, str] = {}


@dataclass(frozen=True)
class Study(Generic[Settings, Row]):
    """A study. Its functions are those of modules, so that every process and machine finds them by name.

    Attributes:
        name: the stem of its files, a word.
        place: where it is defined, `MODULE:NAME`.
        settings: class of its settings.
        table: of its rows, whose first column is the number of the case.
        run: returns the rows of a case; cases depend on settings and number alone.
        cases: how many cases there are at most.
        chunk: cases that a process does at one go, in a few seconds.
        report: makes page and results of all rows.
        program: returns a digest of what decides the rows of settings: code, robots, laws from elsewhere.
        command: returns the command that repeats a study.
        wanted: how much has to come of the cases until the study is done.
        counts: how much of that rows are.
    """

    name: str
    place: str
    settings: type[Settings]
    table: RowTable[Row]
    run: Callable[[Settings, int], Sequence[Row]]
    cases: Callable[[Settings], int]
    chunk: Callable[[Settings], int]
    report: Callable[[Settings, Sequence[Row]], StudyReport]
    program: Callable[[Settings], str]
    command: Callable[[Settings], str]
    wanted: Callable[[Settings], int] | None = None
    counts: Callable[[Settings, Sequence[Row]], int] = field(default=lambda settings, rows: len(case_numbers(rows)))

    def settings_with(self, arguments: Mapping[str, Any]) -> Settings:
        """Return the settings with given values; those that are missing or None are their defaults.

        Raises:
            InputError: there is no such setting, or a value is not allowed.
        """
        return validate(
            {name: value for name, value in arguments.items() if value is not None}, self.settings, self.name
        )

    def needed(self, settings: Settings) -> int:
        """Return how much has to come of the cases: all of them, unless the study says otherwise."""
        return self.cases(settings) if self.wanted is None else self.wanted(settings)


def case_numbers(rows: Sequence[Row]) -> list[int]:
    """Return the numbers of the cases of rows, each once, in their order."""
    return [*dict.fromkeys(row[0] for row in rows)]
