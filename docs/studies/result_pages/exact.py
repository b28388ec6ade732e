# SPDX-License-Identifier: Apache-2.0
"""The page of random crossings on robots that are nearly exact, law by law."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from fivebar_bringup.odds.odds import clopper_pearson
from fivebar_bringup.pages.style import GREY
from fivebar_studies.compare.figures import look_of
from fivebar_studies.engine.running import FinishedStudy
from fivebar_studies.engine.table import RowTable
from fivebar_studies.sweep.rows import FEASIBLE, SCREENED_OUT, SweepRow, controllers_of
from fivebar_studies.sweep.statistics import rate_of, runs_of
from result_pages.page import ResultPage, StudyRun, TextTable
from result_pages.rigs import SWEEP, share_text

RUNS = (StudyRun("exact", SWEEP, {"seed": 2, "cases": 500}, {"cases": 30}),)

NEARLY_ALL = 0.95
"""Least share of each law that is called so."""


class ExactRow(NamedTuple):
    """A line of exact.csv: what became of the crossings of a law.

    Attributes:
        run: that made it.
        controller: by name.
        accepted: crossings that planner and screen accept.
        successes: of these.
        planned: crossings that the planner accepts.
        planned_successes: of these.
    """

    run: str
    controller: str
    accepted: int
    successes: int
    planned: int
    planned_successes: int


def exact_rows(run: str, finished: FinishedStudy) -> list[ExactRow]:
    """Return the rows of a sweep without a rig."""
    rows: Sequence[SweepRow] = finished.rows
    found = []
    for controller in controllers_of(rows):
        good, accepted = rate_of(runs_of(rows, controller, FEASIBLE))
        made, planned = rate_of(runs_of(rows, controller, FEASIBLE, SCREENED_OUT))
        found.append(ExactRow(run, controller, accepted, good, planned, made))
    return found


def exact_table(rows: Sequence[ExactRow]) -> TextTable:
    """Return success with and without the screen, a law a line."""
    lines = []
    for row in rows:
        screened = share_text(row.successes, row.accepted) if row.accepted else "–"
        every = share_text(row.planned_successes, row.planned) if row.planned else "–"
        entries = (
            f"`{row.controller}`",
            f"{row.accepted}",
            screened,
            f"{row.planned}",
            every,
        )
        lines.append(entries)
    columns = ("law", "accepted by the screen", "of these a success", "accepted by the planner", "of these a success")
    return TextTable(columns, lines)


def _answer(rows: Sequence[ExactRow]) -> str:
    made = [f"`{row.controller}` makes {row.successes} of {row.accepted}" for row in rows if row.accepted]
    none = [f"`{row.controller}`" for row in rows if not row.accepted]
    refused = f" The screen refuses all crossings with {', '.join(none)}." if none else ""
    nearly = all(row.successes >= NEARLY_ALL * row.accepted for row in rows)
    lead = "Nearly all" if nearly else "Not all"
    return f"{lead}, where the law's own screen accepts them: {', '.join(made)}.{refused}"


def _figure(rows: Sequence[ExactRow]) -> Figure:
    figure = Figure(figsize=(9.0, 1.1 + 0.45 * len(rows)), layout="constrained")
    axes = figure.subplots()
    for place, row in enumerate(rows):
        for offset, good, count, colour in (
            (-0.18, row.successes, row.accepted, look_of(row.controller)[0]),
            (0.18, row.planned_successes, row.planned, GREY),
        ):
            if count:
                low, high = clopper_pearson(good, count)
                axes.barh(place + offset, 100 * good / count, 0.32, color=colour)
                axes.plot((100 * low, 100 * high), [place + offset] * 2, color="black", linewidth=1.0)
    axes.set_yticks(range(len(rows)), [row.controller for row in rows])
    axes.invert_yaxis()
    axes.set_xlim(0, 101)
    axes.set_xlabel("success, %")
    return figure


EXACT = ResultPage(
    name="exact",
    title="Nearly exact robots",
    question="does each law make the crossings that its screen accepts, where only the body differs from the model?",
    runs=("exact",),
    table=RowTable(ExactRow),
    rows=exact_rows,
    answer=_answer,
    shown=exact_table,
    figure=_figure,
    caption="Success with 95 % intervals: coloured of the crossings that the law's screen accepts, grey of all that"
    " the planner accepts.",
    words="[Random cases](../sweeps.md#random-cases) without a rig: mass, inertia and friction within 15 % of the"
    " model, exact sensors or rounded encoders.  The screens differ from law to law; all laws make the same motions.",
    limits=(
        "Robots as they are: lengths, zeros and joints are exact, and nothing bends, sticks or pushes.",
        "`mpc` and `lqr`, which are on [the benchmark](#which-law).",
    ),
)
