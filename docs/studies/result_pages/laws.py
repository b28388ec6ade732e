# SPDX-License-Identifier: Apache-2.0
"""The page of all laws on the benchmark set."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from fivebar_bringup.odds.odds import clopper_pearson
from fivebar_bringup.pages.style import legend_below
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_description.rounding import in_millimetres
from fivebar_studies.benchmark.crossings import benchmark
from fivebar_studies.benchmark.scoring import scores
from fivebar_studies.compare.figures import look_of
from fivebar_studies.engine.running import FinishedStudy
from fivebar_studies.engine.table import RowTable
from result_pages.page import JUDGED_IN_TIME, ResultPage, StudyRun, TextTable

BENCHMARK = "fivebar_studies.benchmark.study:BENCHMARK"
RIGS = ("ideal", "calibrated", "good", "middling")

CASES = 300
"""The first crossings of the benchmark; of so many a share of 90 % is known to 4 points."""

RUNS = tuple(StudyRun(f"benchmark_{rig}", BENCHMARK, {"rigs": (rig,), "cases": CASES}, {"cases": 12}) for rig in RIGS)


class LawRow(NamedTuple):
    """A line of laws.csv: the score of a law on a rig.

    Attributes:
        run: that made it.
        rig: whose robots.
        controller: by name.
        crossings: the first so many of the benchmark.
        successes: of these.
        error_50: median of the largest distance from the reference (m).
        error_95: 95 % percentile of the same.
        torque_50: median of the largest torque (Nm).
        stopped: crossings that a fault has stopped.
    """

    run: str
    rig: str
    controller: str
    crossings: int
    successes: int
    error_50: float
    error_95: float
    torque_50: float
    stopped: int


def law_rows(run: str, finished: FinishedStudy) -> list[LawRow]:
    """Return the scores of a benchmark."""
    crossings = benchmark()[: 1 + max(result.crossing for result in finished.rows)]
    return [
        LawRow(
            run,
            score.rig,
            score.controller,
            score.crossings,
            score.successes,
            score.error_median,
            score.error_95,
            score.torque_median,
            score.stopped,
        )
        for score in sorted(scores(finished.rows, crossings), key=lambda one: _place(one.controller))
    ]


def _place(controller: str) -> int:
    return [*CONTROLLERS, controller].index(controller)


def _by_law(rows: Sequence[LawRow]) -> dict[str, dict[str, LawRow]]:
    found: dict[str, dict[str, LawRow]] = {}
    for row in rows:
        found.setdefault(row.controller, {})[row.rig] = row
    return found


def _rigs(rows: Sequence[LawRow]) -> list[str]:
    return list(dict.fromkeys(row.rig for row in rows))


def laws_table(rows: Sequence[LawRow]) -> TextTable:
    """Return successes and median of the largest error, a law a line and a rig a column."""
    rigs = _rigs(rows)
    lines = []
    for controller, on in _by_law(rows).items():
        lines.append((f"`{controller}`", *(_entry(on[rig]) if rig in on else "–" for rig in rigs)))
    return TextTable(("law", *rigs), lines)


def _entry(row: LawRow) -> str:
    return f"{row.successes} of {row.crossings}, {in_millimetres(row.error_50)}"


def _answer(rows: Sequence[LawRow]) -> str:
    sentences = []
    for rig in _rigs(rows):
        of_rig = [row for row in rows if row.rig == rig]
        best = max(of_rig, key=lambda row: row.successes)
        low = clopper_pearson(best.successes, best.crossings).low
        equal = [f"`{row.controller}`" for row in of_rig if clopper_pearson(row.successes, row.crossings).high >= low]
        sentences.append(f"{', '.join(equal)} on `{rig}`")
    return f"The most succeed, as far as the intervals tell laws apart, with {'; '.join(sentences)}."


def _figure(rows: Sequence[LawRow]) -> Figure:
    rigs, by_law = _rigs(rows), _by_law(rows)
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    axes = figure.subplots()
    width = 0.8 / len(by_law)
    for place, (controller, on) in enumerate(by_law.items()):
        colour = look_of(controller)[0]
        for column, rig in enumerate(rigs):
            if rig in on:
                good, count = on[rig].successes, on[rig].crossings
                low, high = clopper_pearson(good, count)
                x = column + (place - 0.5 * (len(by_law) - 1)) * width
                axes.bar(x, 100 * good / count, 0.9 * width, color=colour, label=None if column else controller)
                axes.plot((x, x), (100 * low, 100 * high), color="black", linewidth=1.0)
    axes.set_xticks(range(len(rigs)), rigs)
    axes.grid(axis="x", visible=False)
    axes.set_ylabel("success, %")
    legend_below(figure, axes.get_legend_handles_labels()[0], len(by_law))
    return figure


LAWS = ResultPage(
    name="laws",
    title="Which law?",
    question="how many of the benchmark's crossings does each law make, on exact robots and on robots with errors?",
    runs=tuple(run.name for run in RUNS),
    table=RowTable(LawRow),
    rows=law_rows,
    answer=_answer,
    shown=laws_table,
    figure=_figure,
    caption="Success of each law on each rig, with 95 % intervals.",
    words="An entry has the successes and the median of the largest error, on the"
    " [benchmark set](../sweeps.md#the-benchmark-set).  The rigs do worse than [above](#success-on-robots-with-errors),"
    " since nothing is made quicker for loads or refused.",
    limits=(
        JUDGED_IN_TIME,
        "Laws on motions that are timed for them.",
        "Other settings than those of the rig, to which `mpc` and `lqr` were not tuned one by one.",
    ),
)
