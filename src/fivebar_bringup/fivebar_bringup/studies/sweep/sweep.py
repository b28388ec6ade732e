"""Runs random crossings until enough are feasible, in a directory that can be resumed, and writes the page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from itertools import count
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.odds.success import SUCCESS_RULE
from fivebar_bringup.pages.content import Table
from fivebar_bringup.pages.rendering import render
from fivebar_bringup.recorded.results import finite, write_errors
from fivebar_bringup.studies.common.shared_work import stream
from fivebar_bringup.studies.rigs.rig import REQUIRED, find_rig
from fivebar_bringup.studies.sweep import drawing
from fivebar_bringup.studies.sweep.directory import SweepDirectory, SweepSettings, opened
from fivebar_bringup.studies.sweep.drawing import VARIED
from fivebar_bringup.studies.sweep.explanations import explained
from fivebar_bringup.studies.sweep.figures import sweep_figures
from fivebar_bringup.studies.sweep.rows import FEASIBLE, REFUSED, SweepRow
from fivebar_bringup.studies.sweep.running import SWEPT, Batch, counted, run_batch, run_case
from fivebar_bringup.studies.sweep.statistics import (
    branch_table,
    equipment_table,
    error_table,
    explanations_table,
    failures_table,
    overview_table,
    rate_of,
    refusals_table,
    runs_of,
    silence_table,
    within_table,
)
from fivebar_description.interrupts import resumable

BATCH = 10
"""Cases per task of a process; a sweep draws a whole number of batches."""

MOST_DRAWS = 100
"""Largest ratio of drawn cases to requested crossings."""


class Sweep(NamedTuple):
    """Results of a sweep, and the page."""

    page: Path
    overview: Table
    content: Mapping[str, Any]


def sweep(
    out: Path | None,
    seed: int | None = None,
    cases: int | None = None,
    workers: int = 1,
    progress: Callable[[int, int], None] = lambda done, total: None,
    rig: str | None = None,
    controllers: tuple[str, ...] | None = None,
) -> Sweep:
    """Start or resume a sweep, and write sweep.csv, sweep.json, sweep.html and the figures.

    The rows depend on seed and number of cases only, not on the number of processes nor on interruptions.

    Args:
        out: new or empty directory, or that of a sweep to resume; by default runs/sweep-<date>-<time>.
        seed: by default that of the resumed sweep, else 1.
        cases: crossings that the screen has to call feasible for the counted controller; by default those of the
            resumed sweep, else 2000.
        workers: processes to use; fewer than two run everything in this one.
        progress: called with the number of feasible crossings so far and of those requested.
        rig: whose robots to draw; by default that of the resumed sweep, else none.
        controllers: that make each crossing; by default those of the resumed sweep, else all that the engine takes.

    Raises:
        InputError: the directory cannot be used, or holds a sweep with other settings.
        ResumableInterrupt: it was interrupted; the batches that were finished are kept.
    """
    directory, settings = opened(out, seed, cases, rig, controllers)
    kept = (
        f"{directory.path}: interrupted: {directory.rows.name} keeps the finished cases:"
        f" the same command with --out {directory.path} resumes"
    )
    with directory.alone(), write_errors(directory.path), resumable(kept):
        rows = _all_rows(directory, settings, workers, progress)
        return _written(directory, settings, rows)


class Tally:
    """The finished batches, and how many crossings the screen has called feasible for the counted controller.

    Only batches before the first missing one count, so that the order of completion does not matter.
    """

    def __init__(self, cases: int, controllers: Sequence[str] = SWEPT) -> None:
        """Start without batches of a sweep with these controllers."""
        self._cases = cases
        self._controllers = controllers
        self._batches: dict[int, list[SweepRow]] = {}
        self._counted = 0
        self.feasible = 0

    @property
    def enough(self) -> bool:
        """Whether the requested number is reached, or the limit of drawn cases."""
        return self.feasible >= self._cases or self._counted * BATCH >= MOST_DRAWS * self._cases

    @property
    def rows(self) -> list[SweepRow]:
        """The rows of the batches that count, in order."""
        return [row for number in range(self._counted) for row in self._batches[number]]

    def add(self, rows: list[SweepRow]) -> None:
        """Add the rows of a batch; batches beyond the requested number do not count."""
        self._batches[rows[0].case // BATCH] = rows
        while not self.enough and self._counted in self._batches:
            self.feasible += len(runs_of(self._batches[self._counted], counted(self._controllers), FEASIBLE))
            self._counted += 1

    def missing(self, seed: int, rig: str = VARIED) -> Iterator[Batch]:
        """Yield the missing batches, endlessly."""
        there = frozenset(self._batches)
        return (Batch(seed, BATCH * n, BATCH * (n + 1), rig, self._controllers) for n in count() if n not in there)


def _all_rows(
    directory: SweepDirectory, settings: SweepSettings, workers: int, progress: Callable[[int, int], None]
) -> list[SweepRow]:
    found = directory.complete_rows(settings.controllers)
    tally = Tally(settings.cases, settings.controllers)
    kept: list[SweepRow] = []
    for first in sorted({number - number % BATCH for number in found}):
        if all(number in found for number in range(first, first + BATCH)):
            batch = [row for number in range(first, first + BATCH) for row in found[number]]
            kept += batch
            tally.add(batch)
    progress(min(tally.feasible, settings.cases), settings.cases)
    if not tally.enough:
        directory.replace_rows(kept)
        # compile the closed loop once, not in every process
        every_case = (run_case(settings.seed, number, settings.rig, settings.controllers) for number in count())
        next(rows for rows in every_case if rows[0].controller)
        with closing(stream(run_batch, tally.missing(settings.seed, settings.rig), workers)) as coming:
            for batch in coming:
                directory.append_rows(batch)
                tally.add(batch)
                progress(min(tally.feasible, settings.cases), settings.cases)
                if tally.enough:
                    break
    directory.replace_rows(tally.rows)
    return tally.rows


def _written(directory: SweepDirectory, settings: SweepSettings, rows: Sequence[SweepRow]) -> Sweep:
    explanations = [explained(row) for row in runs_of(rows, counted(settings.controllers), FEASIBLE) if not row.success]
    required = find_rig(settings.rig).required if settings.rig else REQUIRED
    overview = overview_table(rows, required)
    tables = [
        overview,
        branch_table(rows),
        within_table(rows),
        silence_table(rows),
        error_table(rows),
        equipment_table(rows),
    ]
    on_rig, of_rig = (f" --rig {settings.rig}", f"rig {settings.rig} · ") if settings.rig else ("", "")
    with_these = "" if settings.controllers == SWEPT else f" --controller {','.join(settings.controllers)}"
    command = f"fivebar sweep --seed {settings.seed}{on_rig}{with_these}"
    details = [
        explanations_table(explanations, lambda number: f"{command} --case {number}"),
        failures_table(rows),
        refusals_table(rows),
    ]
    met, verdict = _verdict(rows, counted(settings.controllers), required)
    drawn = len({row.case for row in rows})
    runs = sum(row.status != REFUSED for row in rows)
    content = finite(
        {
            "settings": settings._asdict(),
            "finished": True,
            "drawn": drawn,
            "runs": runs,
            "met": met,
            "verdict": verdict,
            "tables": [table.as_json() for table in (*tables, *details[1:])],
            "failures": [explanation.as_json() for explanation in explanations],
        }
    )
    pictures = sweep_figures(rows)
    page = render(
        "sweep.html",
        title="Random crossings",
        setting=f"{of_rig}seed {settings.seed} · {drawn} cases drawn, {runs} runs, all simulated",
        drawn=_drawn_words(settings.rig),
        met=met,
        verdict=verdict,
        tables=tables,
        pictures=pictures,
        details=details,
        command=f"{command} --cases {settings.cases}",
    )
    directory.write(page, content, pictures)
    return Sweep(directory.page, overview, content)


def _verdict(rows: Sequence[SweepRow], controller: str, required: float) -> tuple[bool, str]:
    feasible = runs_of(rows, controller, FEASIBLE)
    good, everything = rate_of(feasible)
    by_branch = {
        branch: rate_of([row for row in feasible if row.distal_links == branch])
        for branch in sorted({row.distal_links for row in feasible}, reverse=True)
    }
    branches = "; ".join(f"{made} of {count} with distal links {branch}" for branch, (made, count) in by_branch.items())
    text = (
        f"{controller} completed {good} of the {everything} crossings that were judged feasible before the run"
        f"{f' ({branches})' if branches else ''}; required are {100.0 * required:g} %. Success means: {SUCCESS_RULE}."
    )
    return good >= required * everything, text


def _drawn_words(rig: str) -> str:
    encoders = ", ".join("none, with exact sensors" if one is None else f"{one}" for one in drawing.ENCODERS)
    robots = (
        f"mass, inertia and friction each within {100.0 * drawing.SPREAD:g} % of the controllers' model; encoder counts"
        f" {encoders} (on the motors only, with estimator and torque in steps of 2 mNm); delay of 0 or 1 sample"
    )
    if rig:
        robots = f"robots of the rig {rig}: {find_rig(rig).described} Besides"
    robot = drawing.robot_of(rig)
    return (
        f"Straight segments of the robot {robot} between two random rest points in different assembly modes, in"
        f" each of the four working modes; {drawing.SHORTEST:g} to {drawing.LONGEST:g} s, evenly on a logarithmic"
        f" scale; {robots}; torque limit {drawing.torque_limit_of(robot):g} Nm, {drawing.RATE_HZ} samples/s;"
        f" unified with weight {drawing.weight_of(rig):g}. Every case that the planner accepts is run, also those that"
        " a controller's screen judges infeasible."
    )
