# SPDX-License-Identifier: Apache-2.0
"""A section of results: a question, a figure, a table or two and limits, all made from the rows of a CSV file."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NamedTuple

from matplotlib.figure import Figure

from fivebar_description.modules import load_part
from fivebar_studies.engine.running import FinishedStudy
from fivebar_studies.engine.study import Study
from fivebar_studies.engine.table import Row, RowTable

JUDGED_IN_TIME = "[`path`](../laws.md#path) keeps to the path and not to its time; these runs are judged in time."
"""A limit of sections whose runs are judged by their distance from the timed reference."""


NO_RUNS: Mapping[str, int] = {}
"""Sizes of the whole samples of runs, where none are known."""


class TextTable(NamedTuple):
    """A table as a person reads it: columns, and rows of as many entries."""

    columns: Sequence[str]
    rows: Sequence[Sequence[str]]

    def markdown(self) -> str:
        """Return it in Markdown."""
        lines = [self.columns, ["---"] * len(self.columns), *self.rows]
        return "".join(f"| {' | '.join(entry.replace('|', chr(92) + '|') for entry in line)} |\n" for line in lines)


class StudyRun(NamedTuple):
    """A study that is run for the pages.

    Attributes:
        name: a word; the first column of the rows that are made of it.
        study: where the study is defined, `MODULE:NAME`.
        whole: its settings.
        quick: settings of `--quick`, in place of these.
    """

    name: str
    study: str
    whole: Mapping[str, Any]
    quick: Mapping[str, Any]

    def given(self, quick: bool) -> dict[str, Any]:
        """Return the settings that are given to the study."""
        return {**self.whole, **(self.quick if quick else {})}

    def loaded(self, quick: bool = False) -> tuple[Study[Any, Any], Any]:
        """Return the study with its settings."""
        study: Study[Any, Any] = load_part(self.study)
        return study, study.settings_with(self.given(quick))


class MadeRun(NamedTuple):
    """A line of made.csv: when and how the rows of a run were made.

    Attributes:
        run: name.
        sample: number of cases, of a sweep that of accepted crossings.
        made: date.
        version: of the project; between two releases that of the last one.
        program: digest of the code that decides the rows.
        command: that makes the same rows.
        cases: numbers of cases that were run, 0 for unknown.
        spot_check: digest of the rows of some of these cases, see `making.checked_cases`; empty for unknown.
    """

    run: str
    sample: int
    made: str
    version: str
    program: str
    command: str
    cases: int
    spot_check: str


MADE = RowTable(MadeRun)
"""The table of made.csv."""


@dataclass(frozen=True)
class ResultPage(Generic[Row]):
    """A section of the page and its data. Table, figure and answer are functions of the rows in its CSV file alone.

    Attributes:
        name: stem of its files.
        title, question: in words.
        runs: names of the runs that its rows are made of.
        table: of its rows, whose first column is the name of their run.
        rows: makes rows of a finished run, given its name.
        answer: sentences with the figures that matter.
        shown: the table.
        figure: the one figure.
        caption: below the figure.
        words: on how to read both, as Markdown.
        limits: what the results do not show.
        beside: a further table, below that one; None for none.
    """

    name: str
    title: str
    question: str
    runs: tuple[str, ...]
    table: RowTable[Row]
    rows: Callable[[str, FinishedStudy], Sequence[Row]]
    answer: Callable[[Sequence[Row]], str]
    shown: Callable[[Sequence[Row]], TextTable]
    figure: Callable[[Sequence[Row]], Figure]
    caption: str
    words: str
    limits: tuple[str, ...]
    beside: Callable[[Sequence[Row]], TextTable] | None = None

    def markdown(
        self,
        rows: Sequence[Row],
        made: Sequence[MadeRun],
        whole: Mapping[str, int] = NO_RUNS,
        with_tables: bool = True,
    ) -> str:
        """Return the section of rows, of what is known of the runs that they come from, and of their whole samples.

        Runs of which there are no rows are left out, and without tables also the words on how to read them.
        """
        limits = "\n".join(f"* {limit}" for limit in self.limits)
        given = {row[0] for row in rows}
        made = [one for one in made if one.run in given]
        further = "" if self.beside is None else f"\n{self.beside(rows).markdown()}"
        tables = f"{self.shown(rows).markdown()}{further}\n{self.words} " if with_tables else ""
        return f"""## {self.title}

*{self.question}*

{self.answer(rows)}
{_small(made, whole)}
![Figure: {self.title}]({self.name}.svg)

{self.caption}

{tables}Rows: [{self.name}.csv]({self.name}.csv), columns: [{self.name}.schema.json]({self.name}.schema.json).

Not shown:

{limits}
"""


def _small(made: Sequence[MadeRun], whole: Mapping[str, int]) -> str:
    """Return what is to be said of samples that are smaller than the whole ones, nothing where there are none."""
    small = [f"`{one.run}` {one.sample} of {whole[one.run]}" for one in made if one.sample < whole.get(one.run, 0)]
    if not small:
        return ""
    return f"""
**Smaller samples than the whole ones:** {", ".join(small)}. Rare failures and small differences do not show in so few.
"""
