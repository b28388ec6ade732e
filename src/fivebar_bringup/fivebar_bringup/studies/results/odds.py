"""The page of success odds: what the required share decides, and how well predicted and observed agree."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from fivebar_bringup.odds.intervals import clopper_pearson
from fivebar_bringup.pages.style import BLUE, GREY, VERMILION
from fivebar_bringup.studies.engine.running import FinishedStudy
from fivebar_bringup.studies.engine.table import RowTable
from fivebar_bringup.studies.results.page import ResultPage, TextTable
from fivebar_bringup.studies.results.rigs import share_text
from fivebar_bringup.studies.sweep.rows import FEASIBLE, SweepRow
from fivebar_bringup.studies.sweep.statistics import share_of
from fivebar_control.planning.limits import Risk

ACCEPTED_FROM = (0.95, 0.9, 0.85, 0.8, 0.7)
"""Required shares in the table."""

BINS = ((0.0, 0.7), (0.7, 0.8), (0.8, 0.9), (0.9, 0.95), (0.95, 1.01))
"""Shares of drawn robots by which predicted and observed are compared."""


class OddsRow(NamedTuple):
    """A line of odds.csv: crossings that as many of the drawn robots make.

    Attributes:
        run: that made it.
        rig: whose robots.
        drawn_robots: how many robots were drawn for each crossing.
        likely_robots: of these make the crossing.
        crossings: how many these are.
        successes: of the crossings, on the robot that was to make them.
    """

    run: str
    rig: str
    drawn_robots: int
    likely_robots: int
    crossings: int
    successes: int

    @property
    def share(self) -> float:
        """Share of the drawn robots that make them."""
        return self.likely_robots / self.drawn_robots


def odds_rows(run: str, finished: FinishedStudy) -> list[OddsRow]:
    """Return the rows of a rig's sweep; crossings that are refused for another reason are left out."""
    rows: Sequence[SweepRow] = finished.rows
    judged = [row for row in rows if row.odds is not None and (row.status == FEASIBLE or row.too_unlikely)]
    found: dict[tuple[int, int], list[SweepRow]] = {}
    for row in judged:
        found.setdefault((row.drawn_robots or 0, row.likely_robots or 0), []).append(row)
    return [
        OddsRow(run, rows[0].rig, *key, len(same), sum(row.success is True for row in same))
        for key, same in sorted(found.items())
    ]


def _total(rows: Sequence[OddsRow]) -> tuple[int, int]:
    return sum(row.successes for row in rows), sum(row.crossings for row in rows)


def odds_table(rows: Sequence[OddsRow]) -> TextTable:
    """Return success by the share of robots that a crossing is required to be made by."""
    everything = _total(rows)[1]
    lines = []
    for required in ACCEPTED_FROM:
        good, count = _total([row for row in rows if row.share >= required])
        default = ", the default" if required == Risk().success else ""
        entries = (f"{required:g}{default}", f"{count}", share_text(good, count), share_text(good, everything))
        lines.append(entries)
    columns = ("accepted from", "accepted", "of these a success", "success, if the others count as failures")
    return TextTable(columns, lines)


def _binned(rows: Sequence[OddsRow]) -> Iterator[tuple[float, int, int]]:
    """Yield predicted share, successes and crossings of each bin that has some."""
    for low, high in BINS:
        inside = [row for row in rows if low <= row.share < high]
        good, count = _total(inside)
        if count:
            yield sum(row.share * row.crossings for row in inside) / count, good, count


def _answer(rows: Sequence[OddsRow]) -> str:
    good, count = _total(rows)
    predicted = sum(row.share * row.crossings for row in rows) / count
    return (
        f"A smaller required share accepts more crossings, and more of these fail. The mean of the predicted shares is"
        f" {100 * predicted:.1f} %, and {share_of(good, count).text} of the {count} crossings succeed."
    )


def _figure(rows: Sequence[OddsRow]) -> Figure:
    figure = Figure(figsize=(5.6, 4.4), layout="constrained")
    axes = figure.subplots()
    axes.plot((0, 100), (0, 100), color=GREY, linestyle="--", linewidth=1.0)
    binned = [*_binned(rows)]
    for predicted, good, count in binned:
        low, high = clopper_pearson(good, count)
        axes.plot([100 * predicted] * 2, (100 * low, 100 * high), color=BLUE)
        axes.plot(100 * predicted, 100 * good / count, "o", color=VERMILION)
        axes.annotate(f"{count}", (100 * predicted, 100 * low), ha="center", va="top", fontsize=9)
    axes.set_xlim(min(40.0, *(100 * predicted - 4.0 for predicted, _, _ in binned)), 102)
    axes.set_ylim(0, 102)
    axes.set_xlabel("of the drawn robots make it, %")
    axes.set_ylabel("of the crossings succeed, %")
    return figure


ODDS = ResultPage(
    name="odds",
    title="Success odds",
    question="what does the required share of robots decide, and do predicted and observed success agree?",
    runs=("calibrated", "good", "middling", "middling_normal"),
    table=RowTable(OddsRow),
    rows=odds_rows,
    answer=_answer,
    shown=odds_table,
    figure=_figure,
    caption="Observed over predicted success, with 95 % intervals and the number of crossings. Dashed: both agree.",
    words="The planner tries each crossing on 24 robots drawn from the rig `middling`, none of them the one that then"
    " moves ([odds](../motions.md#odds)). `risk.success` is the share of them that a motion needs. Refused crossings"
    " are run all the same. Other durations, time laws and places of crossing are tried only where fewer than the"
    " default make the first motion, whatever the line of the table.",
    limits=(
        "Errors that are distributed otherwise: the robots are drawn as those of the rig are, evenly within the"
        " bounds.",
        "Robots that are worse than declared.",
        "Other rigs and other laws.",
    ),
)
