# SPDX-License-Identifier: Apache-2.0
"""The page of success odds: what the required share decides, and how well predicted and observed agree."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from fivebar_bringup.odds.odds import Interval, clopper_pearson
from fivebar_bringup.pages.style import AMBER, BLUE, GREEN, GREY, PURPLE, SKY, VERMILION
from fivebar_control.planning.risk import Risk
from fivebar_studies.engine.running import FinishedStudy
from fivebar_studies.engine.table import RowTable
from fivebar_studies.sweep.rows import FEASIBLE, SweepRow
from fivebar_studies.sweep.statistics import share_of
from result_pages.page import ResultPage, TextTable
from result_pages.rigs import RUNS, rig_words, share_text

ACCEPTED_FROM = (0.9, 0.7)
"""Required shares in the table: the default, and smaller ones, which accept more."""

BINS = 10
"""Equal intervals of the share of drawn robots, in each of which predicted and observed are compared."""

COLOURS = (BLUE, GREEN, VERMILION, PURPLE, AMBER, SKY)
"""A run each."""

APART = 0.5
"""Distance (%) in the figure between runs in the same interval."""


class OddsRow(NamedTuple):
    """A line of odds.csv: crossings that are accepted or refused alike, and that as many of the drawn robots make.

    Attributes:
        run: that made it.
        rig: whose robots.
        drawn_robots: how many robots were drawn for each crossing.
        likely_robots: of these make the crossing.
        accepted: whether the crossings were accepted; the drawn robots are then others than those that accepted them.
        crossings: how many these are.
        successes: of the crossings, on the robot that was to make them.
    """

    run: str
    rig: str
    drawn_robots: int
    likely_robots: int
    accepted: bool
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
    found: dict[tuple[int, int, bool], list[SweepRow]] = {}
    for row in judged:
        key = row.drawn_robots or 0, row.likely_robots or 0, row.status == FEASIBLE
        found.setdefault(key, []).append(row)
    return [
        OddsRow(run, rows[0].rig, *key, len(same), sum(row.success is True for row in same))
        for key, same in sorted(found.items())
    ]


class Agreement(NamedTuple):
    """How predicted and observed success of some crossings agree.

    Attributes:
        predicted: mean share of the drawn robots that make a crossing.
        successes: of the crossings.
        crossings: how many these are.
    """

    predicted: float
    successes: int
    crossings: int

    @property
    def observed(self) -> float:
        """The share of crossings that succeed."""
        return self.successes / self.crossings

    @property
    def interval(self) -> Interval:
        """The interval of the observed share for 95 %."""
        return clopper_pearson(self.successes, self.crossings)

    @property
    def bias(self) -> float:
        """The predicted share minus the observed one."""
        return self.predicted - self.observed

    @property
    def bias_text(self) -> str:
        """The bias in points, with the interval that follows from that of the observed share."""
        low, high = (_points(self.predicted - end) for end in reversed(self.interval))
        return f"{_points(self.bias)} ({low} to {high})"


def _points(share: float) -> str:
    """Return a signed share in points, without a sign where it rounds to zero."""
    rounded = round(100.0 * share, 1)
    return f"{rounded:+.1f}" if rounded else "0.0"


def agreement_of(rows: Sequence[OddsRow]) -> Agreement | None:
    """Return how predicted and observed success agree, None without crossings."""
    good, count = _total(rows)
    if not count:
        return None
    return Agreement(sum(row.share * row.crossings for row in rows) / count, good, count)


def _total(rows: Sequence[OddsRow]) -> tuple[int, int]:
    return sum(row.successes for row in rows), sum(row.crossings for row in rows)


def _by_rig(rows: Sequence[OddsRow]) -> dict[str, list[OddsRow]]:
    """Return the rows of each rig that there is."""
    found: dict[str, list[OddsRow]] = {}
    for row in rows:
        found.setdefault(row.rig, []).append(row)
    return found


def bias_table(rows: Sequence[OddsRow]) -> TextTable:
    """Return by how much the success that is stated of accepted crossings exceeds the observed one, a rig a line."""
    lines = []
    for rig, same in _by_rig(rows).items():
        found = agreement_of([row for row in same if row.accepted])
        if found is not None:
            predicted = f"{100.0 * found.predicted:.2f} %"
            observed = share_text(found.successes, found.crossings)
            lines.append((rig_words(rig), f"{found.crossings}", predicted, observed, found.bias_text))
    return TextTable(("robots", "accepted", "stated, mean", "succeed", "stated minus observed, points"), lines)


def odds_table(rows: Sequence[OddsRow]) -> TextTable:
    """Return success by the share of robots that a crossing is required to be made by, a rig a column."""
    rigs = _by_rig(rows)
    lines = []
    for required in ACCEPTED_FROM:
        default = ", the default" if required == Risk().success else ""
        lines.append((f"{required:g}{default}", *(_accepted_from(required, same) for same in rigs.values())))
    return TextTable(("accepted from", *map(rig_words, rigs)), lines)


def _accepted_from(required: float, rows: Sequence[OddsRow]) -> str:
    """Return how many crossings are accepted, the share of these that succeed, and of all that do and are accepted."""
    everything = _total(rows)[1]
    good, count = _total([row for row in rows if row.accepted or row.share >= required])
    of_accepted = share_of(good, count).text if count else "–"
    return f"{count} of {everything}: {of_accepted}; {share_of(good, everything).text}"


def binned(rows: Sequence[OddsRow]) -> list[Agreement]:
    """Return how predicted and observed success agree in each of the intervals that has crossings."""
    inside: list[list[OddsRow]] = [[] for _ in range(BINS)]
    for row in rows:
        # in whole numbers, since a share at an edge is rounded
        inside[min(BINS * row.likely_robots // row.drawn_robots, BINS - 1)].append(row)
    return [found for found in map(agreement_of, inside) if found is not None]


def _answer(rows: Sequence[OddsRow]) -> str:
    told = ["A smaller required share accepts more crossings, and more of these fail."]
    accepted = _by_rig([row for row in rows if row.accepted])
    found = {rig: agreement for rig, same in accepted.items() if (agreement := agreement_of(same))}
    if found:
        least, most = (choose(found, key=lambda rig: found[rig].bias) for choose in (min, max))
        told.append(
            f"Stated minus observed success of accepted crossings is between {_points(found[least].bias)} points on"
            f" `{least}` and {_points(found[most].bias)} points on `{most}`."
        )
    return " ".join(told)


def _figure(rows: Sequence[OddsRow]) -> Figure:
    figure = Figure(figsize=(6.4, 5.2), layout="constrained")
    axes = figure.subplots()
    axes.plot((0, 100), (0, 100), color=GREY, linestyle="--", linewidth=1.0)
    rigs = _by_rig(rows)
    for number, (rig, same) in enumerate(rigs.items()):
        colour, shift = COLOURS[number % len(COLOURS)], APART * (number - 0.5 * (len(rigs) - 1))
        places = binned(same)
        for one in places:
            low, high = one.interval
            axes.plot([100 * one.predicted + shift] * 2, (100 * low, 100 * high), color=colour, linewidth=1.2)
        across = [100 * place.predicted + shift for place in places]
        axes.plot(
            across, [100 * place.observed for place in places], "o", color=colour, markersize=4, label=rig_words(rig)
        )
    axes.set_xlim(-2, 102)
    axes.set_ylim(-2, 102)
    axes.set_xticks(range(0, 101, 10))
    axes.set_xlabel("of the drawn robots make it, %")
    axes.set_ylabel("of the crossings succeed, %")
    axes.legend(loc="upper center", bbox_to_anchor=(0.5, -0.12), ncol=3, frameon=False)
    return figure


ODDS = ResultPage(
    name="odds",
    title="Success odds",
    question="what does the required share of robots decide, and do predicted and observed success agree?",
    runs=tuple(run.name for run in RUNS),
    table=RowTable(OddsRow),
    rows=odds_rows,
    answer=_answer,
    shown=bias_table,
    beside=odds_table,
    figure=_figure,
    caption="Observed over predicted success in ten intervals of the predicted one, with 95 % intervals. Dashed: both"
    " agree.",
    words="*Stated* are the [odds](../motions.md#odds) of the planner; stated minus observed should be at most two"
    " points. Figure and second table have the refused crossings too. An entry there says how many crossings are"
    " accepted, the share of these that succeed, and the share of all that are accepted and succeed.",
    limits=("Errors that are distributed otherwise, other rigs and laws.",),
)
