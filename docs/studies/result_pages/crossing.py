# SPDX-License-Identifier: Apache-2.0
"""The page of what crossing buys: reach, time and work."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.figure import Figure

from fivebar_bringup.odds.odds import clopper_pearson
from fivebar_bringup.pages.style import BLUE, GREY, VERMILION
from fivebar_studies.engine.running import FinishedStudy
from fivebar_studies.engine.table import RowTable
from result_pages.crossing_gain import MODE, PAIR, GainRow
from result_pages.crossing_gain import ROBOT as ALL_MODES
from result_pages.page import ResultPage, StudyRun, TextTable

RUNS = (StudyRun("crossing_gain", "result_pages.crossing_gain:CROSSING_GAIN", {}, {"pairs": 6}),)


class CrossingRow(NamedTuple):
    """A line of crossing.csv: what a working mode or a robot reaches, or the motions between a pair of places.

    Attributes:
        run: that made it.
        robot: by the name of its file.
        kind: "working mode", "all working modes" or "pair".
        mode: the working mode.
        area: of all rests (cm^2).
        largest: area of the largest part that is joined without crossing (cm^2).
        joined: share of all pairs of rests that a motion without crossing joins.
        joined_across: the same of motions that may cross.
        time_without, time_with: quickest motion of a pair with no crossing, and of all motions (s).
        work_without, work_with: positive work of the motors in these (J).
    """

    run: str
    robot: str
    kind: str
    mode: str
    area: float | None
    largest: float | None
    joined: float | None
    joined_across: float | None
    time_without: float | None
    time_with: float | None
    work_without: float | None
    work_with: float | None


def crossing_rows(run: str, finished: FinishedStudy) -> list[CrossingRow]:
    """Return the rows of the study."""
    rows: Sequence[GainRow] = finished.rows
    return [CrossingRow(run, *row[1:]) for row in rows]


class CrossingGain:
    """The gain of a robot by crossing."""

    def __init__(self, robot: str, rows: Sequence[CrossingRow]) -> None:
        """Sort the rows of a robot."""
        own = [row for row in rows if row.robot == robot]
        self.robot = robot
        self.modes = [row for row in own if row.kind == MODE]
        self.all_modes = next(row for row in own if row.kind == ALL_MODES)
        pairs = [row for row in own if row.kind == PAIR]
        self.pairs = len(pairs)
        self.only_across = sum(row.time_without is None and row.time_with is not None for row in pairs)
        self.unjoined = sum(row.time_with is None for row in pairs)
        both = [row for row in pairs if row.time_without is not None and row.time_with is not None]
        self.times = np.array([(row.time_without, row.time_with) for row in both], dtype=np.float64).reshape(-1, 2)
        self.works = np.array([(row.work_without, row.work_with) for row in both], dtype=np.float64).reshape(-1, 2)

    @property
    def quicker(self) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
        """Time with crossing over that without, of the pairs where it is less."""
        ratios: np.ndarray[tuple[int], np.dtype[np.float64]] = self.times[:, 1] / self.times[:, 0]
        return ratios[ratios < 1.0]


def _gains(rows: Sequence[CrossingRow]) -> list[CrossingGain]:
    return [CrossingGain(robot, rows) for robot in dict.fromkeys(row.robot for row in rows)]


def _areas(row: CrossingRow) -> str:
    return f"{row.area:.0f}, {row.largest:.0f} cm², {100 * (row.joined or 0.0):.1f} %"


def _pair_of(values: np.ndarray[tuple[int, int], np.dtype[np.float64]], unit: str, kind: str) -> str:
    if not len(values):
        return "–"
    without, across = (np.median if kind == "median" else np.mean)(values, axis=0).tolist()
    return f"{without:.3g}, {across:.3g} {unit}"


def _ratios(gain: CrossingGain) -> str:
    ratios = gain.quicker
    return f"{np.median(ratios):.2f}, {ratios.min():.2f}" if len(ratios) else "–"


LINES: tuple[tuple[str, Callable[[CrossingGain], str]], ...] = (
    (
        "pairs of rests joined without crossing, in any working mode",
        lambda one: f"{100 * (one.all_modes.joined or 0):.1f} %",
    ),
    ("random pairs of places, of these in no working mode", lambda one: f"{one.pairs}, {one.unjoined}"),
    ("joined only by crossing", lambda one: f"{one.only_across}"),
    ("joined without too, of these quicker with crossing", lambda one: f"{len(one.times)}, {len(one.quicker)}"),
    ("there, time with crossing over without: median, least", _ratios),
    ("time of those joined without too, without and with: median", lambda one: _pair_of(one.times, "s", "median")),
    ("the same: mean", lambda one: _pair_of(one.times, "s", "mean")),
    ("work of these, without and with: median", lambda one: _pair_of(one.works, "J", "median")),
    ("the same: mean", lambda one: _pair_of(one.works, "J", "mean")),
)


def crossing_table(rows: Sequence[CrossingRow]) -> TextTable:
    """Return the table, a robot a column."""
    gains = _gains(rows)
    lines = [
        (f"working mode {mode.mode}: all rests, largest part and pairs joined without crossing", *entries)
        for mode, *entries in (
            (modes[0], *map(_areas, modes)) for modes in zip(*(gain.modes for gain in gains), strict=True)
        )
    ]
    lines += [(words, *map(entry, gains)) for words, entry in LINES]
    return TextTable(("", *(gain.robot for gain in gains)), lines)


def _answer(rows: Sequence[CrossingRow]) -> str:
    def of(one: CrossingGain) -> str:
        more = [(mode.area or 0.0) / (mode.largest or 1.0) - 1.0 for mode in one.modes]
        low, high = clopper_pearson(one.only_across, one.pairs)
        return (
            f"On `{one.robot}` crossing adds {100 * min(more):.0f} to {100 * max(more):.0f} % to the largest area in a"
            f" working mode, and {one.only_across} of {one.pairs} random pairs of places are joined only by it"
            f" ({100 * low:.0f} to {100 * high:.0f} %)."
        )

    return " ".join(map(of, _gains(rows)))


def _figure(rows: Sequence[CrossingRow]) -> Figure:
    gains = _gains(rows)
    figure = Figure(figsize=(9.0, 3.6), layout="constrained")
    left, *right = figure.subplots(1, 1 + len(gains))
    for number, one in enumerate(gains):
        for place, mode in enumerate(one.modes):
            y = place + number * (len(one.modes) + 1)
            left.barh(y, mode.area or 0.0, color=VERMILION)
            left.barh(y, mode.largest or 0.0, color=BLUE)
    names = [
        (f"{one.robot} {mode.mode}", n * (len(one.modes) + 1) + k)
        for n, one in enumerate(gains)
        for k, mode in enumerate(one.modes)
    ]
    left.set_yticks([place for _, place in names], [name for name, _ in names])
    left.invert_yaxis()
    left.set_xlabel("area, cm²")
    for axes, one in zip(right, gains, strict=True):
        axes.plot(one.times[:, 0], one.times[:, 1], "o", color=VERMILION, markersize=3)
        top = float(one.times.max(initial=1e-9))
        axes.plot((0, top), (0, top), color=GREY, linewidth=1.0, linestyle="--")
        axes.set_title(one.robot)
        axes.set_xlabel("time without crossing, s")
    right[0].set_ylabel("time with crossing, s")
    return figure


CROSSING = ResultPage(
    name="crossing",
    title="What crossing buys",
    question="how much reach, time and work does crossing the Type 2 locus save?",
    runs=("crossing_gain",),
    table=RowTable(CrossingRow),
    rows=crossing_rows,
    answer=_answer,
    shown=crossing_table,
    figure=_figure,
    caption="Left: the largest area that is joined without crossing (blue), and what crossing adds. Right: the quickest"
    " motion between random places, with crossing over without.",
    words="Counted with planner and screen of [requested motions](../motions.md) for `unified`, at rests on a grid of"
    " 6 mm. Each pair is planned with `fastest` in every working mode that has both places. With crossing every working"
    " mode is one part. The work is that of both motors along the reference where it is positive.",
    limits=(
        "A feasible straight line without a crossing ends the search, so what crossing saves is understated.",
        "The time to change the working mode is not counted against the motions without crossing.",
        "Tolerances, an estimator and loads, which allow fewer crossings; collisions and payloads.",
    ),
)
