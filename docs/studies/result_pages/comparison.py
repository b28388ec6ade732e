# SPDX-License-Identifier: Apache-2.0
"""The page of all laws on the same two motions."""

from __future__ import annotations

import json
from collections.abc import Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from fivebar_bringup.pages.style import legend_below
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.units import plain
from fivebar_description.rounding import in_millimetres
from fivebar_studies.compare.compare import ComparisonSettings, cases_of
from fivebar_studies.compare.figures import look_of
from fivebar_studies.compare.results import ComparisonRow
from fivebar_studies.engine.directory import PROGRAM
from fivebar_studies.engine.running import FinishedStudy
from fivebar_studies.engine.table import RowTable
from result_pages.page import JUDGED_IN_TIME, ResultPage, StudyRun, TextTable

QUICK = {"scenarios": ("middle",), "durations": (1.0,), "rigs": ("ideal", "realistic")}
RUNS = (StudyRun("compare", "fivebar_studies.compare.compare:COMPARISON", {}, QUICK),)


class MotionRow(NamedTuple):
    """A line of comparison.csv: a motion made by a law on a rig.

    Attributes:
        run: that made it.
        motion, rig, controller: what was run.
        segment_duration: of each segment (s); nothing for the quickest that the screen allows.
        tight: whether the drives have a limit of torque that is tight.
        outcome: what became of it.
        error_peak: largest distance from the reference (m).
        torque_peak: largest torque applied (Nm).
        torque_requested: largest torque requested (Nm).
        energy: spent by the motors (J).
    """

    run: str
    motion: str
    rig: str
    controller: str
    segment_duration: float | None
    tight: bool
    outcome: str
    error_peak: float | None
    torque_peak: float | None
    torque_requested: float | None
    energy: float | None


def motion_rows(run: str, finished: FinishedStudy) -> list[MotionRow]:
    """Return the rows of a comparison."""
    rows: Sequence[ComparisonRow] = finished.rows
    given = {name: value for name, value in finished.content["settings"].items() if name != PROGRAM}
    asked = len(cases_of(ComparisonSettings.model_validate_json(json.dumps(given))).asked)
    return [
        MotionRow(
            run,
            row.motion,
            row.rig,
            row.controller,
            row.segment_duration_s,
            row.case >= asked,
            row.outcome,
            row.tracking_error_peak_m,
            row.torque_peak_nm,
            row.torque_requested_peak_nm,
            row.energy_j,
        )
        for row in rows
    ]


Pair = tuple[str, str]


def _untightened(rows: Sequence[MotionRow]) -> dict[Pair, list[MotionRow]]:
    """Return the runs of each rig and law, without those under the tight limit of torque."""
    found: dict[Pair, list[MotionRow]] = {}
    for row in rows:
        if not row.tight:
            found.setdefault((row.rig, row.controller), []).append(row)
    return found


def _made(rows: Sequence[MotionRow]) -> int:
    return sum(row.outcome == RunOutcome.SUCCEEDED for row in rows)


def _largest(rows: Sequence[MotionRow], name: str) -> float | None:
    return max((value for row in rows if (value := getattr(row, name)) is not None), default=None)


def comparison_table(rows: Sequence[MotionRow]) -> TextTable:
    """Return the worst of each law on each rig."""
    lines = []
    for (rig, controller), runs in _untightened(rows).items():
        entries = (
            rig,
            f"`{controller}`",
            f"{_made(runs)} of {len(runs)}",
            in_millimetres(_largest(runs, "error_peak"), 3),
            plain(_largest(runs, "torque_peak"), "Nm"),
            plain(_largest(runs, "torque_requested"), "Nm"),
            plain(_largest(runs, "energy"), "J"),
        )
        lines.append(entries)
    columns = ("rig", "law", "succeeded", "largest error", "torque applied", "torque requested", "energy")
    return TextTable(columns, lines)


def _answer(rows: Sequence[MotionRow]) -> str:
    by_law: dict[str, list[MotionRow]] = {}
    for (_, controller), runs in _untightened(rows).items():
        by_law.setdefault(controller, []).extend(runs)
    by_count: dict[tuple[int, int], list[str]] = {}
    for controller, runs in by_law.items():
        by_count.setdefault((_made(runs), len(runs)), []).append(f"`{controller}`")
    counts = sorted(by_count, reverse=True)
    made = [f"{good} of {count} with {', '.join(by_count[good, count])}" for good, count in counts]
    motions = ", ".join(dict.fromkeys(f"`{row.motion}`" for row in rows))
    durations = ", ".join(f"{one:g}" for one in sorted({row.segment_duration for row in rows if row.segment_duration}))
    return f"On {motions}, with segments of {durations} s, runs succeed: {'; '.join(made)}."


def _figure(rows: Sequence[MotionRow]) -> Figure:
    groups = _untightened(rows)
    rigs = list(dict.fromkeys(rig for rig, _ in groups))
    laws = list(dict.fromkeys(controller for _, controller in groups))
    figure = Figure(figsize=(9.0, 3.8), layout="constrained")
    axes = figure.subplots()
    for place, controller in enumerate(laws):
        colour, marker = look_of(controller)
        for column, rig in enumerate(rigs):
            runs = groups.get((rig, controller), [])
            x = column + 0.09 * (place - 0.5 * (len(laws) - 1))
            errors = [1e3 * row.error_peak for row in runs if row.error_peak and row.outcome == RunOutcome.SUCCEEDED]
            lost = [1e3 * row.error_peak for row in runs if row.error_peak and row.outcome != RunOutcome.SUCCEEDED]
            label = None if column else controller
            axes.plot([x] * len(errors), errors, marker, color=colour, markersize=5, linestyle="none", label=label)
            axes.plot([x] * len(lost), lost, "x", color=colour, markersize=6, linestyle="none")
    axes.set_yscale("log")
    axes.set_ylabel("largest error, mm")
    axes.set_xticks(range(len(rigs)), rigs)
    axes.grid(axis="x", visible=False)
    legend_below(figure, axes.get_legend_handles_labels()[0], len(laws))
    return figure


COMPARISON = ResultPage(
    name="comparison",
    title="All laws on the same motions",
    question="what do error, torque and energy of each law come to on motions of the thesis?",
    runs=("compare",),
    table=RowTable(MotionRow),
    rows=motion_rows,
    answer=_answer,
    shown=comparison_table,
    figure=_figure,
    caption="Largest error of every run; crosses: the run did not succeed.",
    words="The entries are the worst over all motions and durations, on [rigs](../sweeps.md#rigs) without drawn errors."
    " `fivebar compare SCENARIO` does the same for your motion.",
    limits=(
        "Robots drawn at random, which are [above](#which-law).",
        JUDGED_IN_TIME,
    ),
)
