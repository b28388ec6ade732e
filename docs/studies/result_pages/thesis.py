# SPDX-License-Identifier: Apache-2.0
"""The page of what is reproduced of the thesis."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from fivebar_bringup.pages.style import BLUE, GREEN, PURPLE, VERMILION
from fivebar_studies.engine.running import FinishedStudy
from fivebar_studies.engine.table import RowTable
from fivebar_studies.reproduce.claims import ClaimRow
from fivebar_studies.reproduce.verdicts import Verdict
from result_pages.page import ResultPage, StudyRun, TextTable

OPEN = (Verdict.NOT_REPRODUCED, Verdict.UNDECIDED)
"""Verdicts of the claims in the table; the CSV has all."""

RUNS = (StudyRun("reproduce", "fivebar_studies.reproduce.reproduce:REPRODUCTION", {}, {"quick": True}),)


class ThesisRow(NamedTuple):
    """A line of thesis.csv: a figure or claim of the thesis, and what becomes of it here.

    Attributes:
        run: that made it.
        place: in the thesis.
        title: what it is about.
        thesis: what the thesis reports.
        measured: what was found here.
        verdict: whether it is reproduced.
        reason: why.
    """

    run: str
    place: str
    title: str
    thesis: str
    measured: str
    verdict: str
    reason: str


def thesis_rows(run: str, finished: FinishedStudy) -> list[ThesisRow]:
    """Return the rows of a reproduction."""
    claims: Sequence[ClaimRow] = finished.shown
    return [
        ThesisRow(
            run,
            claim.place,
            claim.title,
            claim.thesis,
            claim.measured,
            f"{claim.judgement.verdict}",
            claim.judgement.reason,
        )
        for claim in claims
    ]


def thesis_table(rows: Sequence[ThesisRow]) -> TextTable:
    """Return the claims that are not reproduced, and those that cannot be decided here."""
    shown = [row for verdict in OPEN for row in rows if row.verdict == verdict]
    lines = [(row.verdict, row.place, row.title, row.reason) for row in shown]
    return TextTable(("verdict", "thesis", "about", "why"), lines)


def _counts(rows: Sequence[ThesisRow]) -> dict[str, int]:
    return {f"{verdict}": sum(row.verdict == verdict for row in rows) for verdict in Verdict}


def _answer(rows: Sequence[ThesisRow]) -> str:
    counts = ", ".join(f"{count} {verdict}" for verdict, count in _counts(rows).items() if count)
    return f"{len(rows)} figures and claims: {counts}."


def _figure(rows: Sequence[ThesisRow]) -> Figure:
    figure = Figure(figsize=(9.0, 1.3))
    axes = figure.add_axes((0.0, 0.0, 1.0, 1.0))
    left = 0
    for (verdict, count), colour in zip(_counts(rows).items(), (GREEN, BLUE, VERMILION, PURPLE), strict=True):
        if count:
            axes.barh(0, count, left=left, color=colour)
            axes.text(left + 0.5 * count, 0, f"{count} {verdict}", ha="center", va="center", color="white", fontsize=9)
        left += count
    axes.set_axis_off()
    return figure


THESIS = ResultPage(
    name="thesis",
    title="What of the thesis is reproduced?",
    question="which figures and claims of the thesis does this project reproduce, and which not?",
    runs=("reproduce",),
    table=RowTable(ThesisRow),
    rows=thesis_rows,
    answer=_answer,
    shown=thesis_table,
    figure=_figure,
    caption="Verdicts on figures and claims.",
    words="The rows have the others too. `fivebar reproduce` draws every figure beside the numbers and states the rule"
    " of every verdict.",
    limits=(
        "The experiments of the thesis on its robot. They are judged by simulation.",
        "Claims that no number decides.",
    ),
)
