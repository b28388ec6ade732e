# SPDX-License-Identifier: Apache-2.0
"""The tables of a sweep."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Iterable, Sequence

import numpy as np

from fivebar_bringup.odds.odds import PEAK_LIMIT, clopper_pearson
from fivebar_bringup.pages.content import Cell, Entry, Line, Table, table
from fivebar_bringup.simulation.run_metrics import LEFT
from fivebar_bringup.units import error_of, plain
from fivebar_studies.sweep.drawing import DELAYS, ENCODERS
from fivebar_studies.sweep.explanations import Explanation
from fivebar_studies.sweep.rows import FEASIBLE, REFUSED, SCREENED_OUT, SweepRow, controllers_of
from fivebar_studies.sweep.running import counted

PERCENTILES = (50.0, 90.0, 95.0, 99.0, 99.9, 100.0)

ODDS_BINS = tuple((0.1 * step, 0.1 * (step + 1) if step < 9 else 1.01) for step in range(10))
"""Shares of drawn robots by which crossings are counted."""

SCREENED = "called feasible", "of them made", "share", "95 %"
"""Columns of the runs that the screen accepts."""

PLANNER_REASONS = {
    "meets the Type 1 singularity": "meets Type 1",
    "is out of reach": "out of reach",
    "homing_contradicted": "the estimator could not tell the assembly mode at the start",
}
"""Phrases of the planner's refusals, and the reasons that they stand for."""


def rate_of(rows: Sequence[SweepRow]) -> tuple[int, int]:
    """Return how many runs succeeded, of how many."""
    return sum(row.success is True for row in rows), len(rows)


def runs_of(rows: Iterable[SweepRow], controller: str, *statuses: str) -> list[SweepRow]:
    """Return the runs of a controller with one of these statuses."""
    return [row for row in rows if row.controller == controller and row.status in statuses]


def overview_table(rows: Sequence[SweepRow], required: float) -> Table:
    """Return success with and without the screen, and whether the counted controller makes the required share."""
    lines = []
    for controller in controllers_of(rows):
        good, feasible = rate_of(runs_of(rows, controller, FEASIBLE))
        succeeded, planned = rate_of(runs_of(rows, controller, FEASIBLE, SCREENED_OUT))
        judged = feasible and controller == counted(controllers_of(rows))
        share = share_of(good, feasible, good >= required * feasible if judged else None)
        screened = controller, feasible, good, share, interval_of(good, feasible)
        lines.append((*screened, planned, succeeded, share_of(succeeded, planned)))
    return table(
        "overview",
        "Success",
        "Feasible cases are accepted by the planner and judged feasible by the controller's own screen before the run."
        " The screen of a blended controller is stricter than that of unified, so the sets differ; the planned"
        " cases are the same for all. Intervals are those of Clopper and Pearson.",
        ("controller", *SCREENED, "planned at all", "of these made", "share without the screen"),
        lines,
    )


def branch_table(rows: Sequence[SweepRow]) -> Table:
    """Return success by the branch of the Type 2 locus that is crossed."""
    lines = []
    for controller in controllers_of(rows):
        planned = runs_of(rows, controller, FEASIBLE, SCREENED_OUT)
        for branch in sorted({row.distal_links for row in planned}, reverse=True):
            across = [row for row in planned if row.distal_links == branch]
            screened = rate_of(runs_of(across, controller, FEASIBLE))
            lines.append((controller, branch, *_rated(*screened), *_rated(*rate_of(across))))
    return table(
        "branches",
        "By the branch of the locus",
        "Whether the distal links are stretched where the path crosses the locus, with the platform between the elbows,"
        " or folded onto each other, where the elbows pass each other. A path may cross both.",
        (
            "controller",
            "distal links",
            *SCREENED,
            "planned at all",
            "of these made",
            "share without the screen",
            "95 % without the screen",
        ),
        lines,
    )


def _rated(good: int, count: int) -> tuple[int, int, Cell, Cell]:
    """Return how many there are, how many of them are good, their share and its interval."""
    return count, good, share_of(good, count), interval_of(good, count)


def odds_table(rows: Sequence[SweepRow]) -> Table:
    """Return how many crossings succeed by the share of drawn robots that make them, refused ones run as well."""
    known = [row for row in rows if row.odds is not None]
    lines = []
    for low, high in ODDS_BINS:
        inside = [row for row in known if row.odds is not None and low <= row.odds < high]
        if inside:
            lines.append(_odds_line(f"{100.0 * low:.0f} to {100.0 * min(high, 1.0):.0f} %", inside))
    if known:
        lines.append(_odds_line("all", known))
        lines.append(_odds_line("all that are not too unlikely", [row for row in known if row.status == FEASIBLE]))
    return table(
        "odds",
        "By the odds",
        "The planner tries a crossing on robots drawn as those of the rig, of which none is the one that then makes it,"
        " and refuses one that too few of them make. Predicted is the mean of these shares; refused crossings are run"
        " all the same. Judged strictly, a crossing that is refused for its odds alone is a failure: then the share of"
        f" successes is {_strict(known)}.",
        ("of the drawn robots succeed", "crossings", "predicted", "of them made", "share", "95 %"),
        lines,
    )


def _odds_line(words: str, rows: Sequence[SweepRow]) -> tuple[Entry, ...]:
    predicted = sum(row.odds or 0.0 for row in rows) / len(rows) if rows else 0.0
    count, good, share, interval = _rated(*rate_of(rows))
    return words, count, Cell(f"{100.0 * predicted:.1f} %", predicted), good, share, interval


def _strict(rows: Sequence[SweepRow]) -> str:
    """Return the share of successes where what is refused for its odds alone has failed."""
    judged = [row for row in rows if row.status == FEASIBLE or row.too_unlikely]
    good = sum(row.success is True for row in judged if row.status == FEASIBLE)
    if not judged:
        return "not known"
    return f"{good} of {len(judged)}, {share_of(good, len(judged)).text} ({interval_of(good, len(judged)).text})"


def within_table(rows: Sequence[SweepRow]) -> Table:
    """Return how many feasible crossings stayed close to their reference, wherever they ended."""
    lines = []
    for controller in controllers_of(rows):
        runs = runs_of(rows, controller, FEASIBLE)
        for limit in (rows[0].draw.size * PEAK_LIMIT, LEFT):
            near = sum(row.within(limit) for row in runs)
            lines.append((controller, _figure(limit, "m"), *_rated(near, len(runs))))
    return table(
        "within",
        "Close to the reference",
        "Feasible crossings that stayed within a distance of their reference throughout, without a fault and in the"
        " planned assembly mode. A success is within 1 mm at the end besides.",
        ("controller", "within", "feasible", "of them", "share", "95 %"),
        lines,
    )


def silence_table(rows: Sequence[SweepRow]) -> Table:
    """Return how many runs were lost, and how many of them silently, with and without those that were screened out."""
    lines = []
    for controller in controllers_of(rows):
        for words, statuses in (("feasible", (FEASIBLE,)), ("all planned", (FEASIBLE, SCREENED_OUT))):
            runs = runs_of(rows, controller, *statuses)
            lost = sum(row.left_time is not None or row.mode_changes != row.crossings for row in runs)
            count, silent, share, interval = _rated(sum(row.silent for row in runs), len(runs))
            lines.append((controller, words, count, lost, silent, share, interval))
    return table(
        "silence",
        "Silent failures",
        "A run is lost where the robot leaves its reference by more than 5 mm or ends in another assembly mode than"
        " planned. It is lost silently where no fault comes within 50 ms.",
        ("controller", "of the crossings", "runs", "lost", "silently", "share of runs", "95 %"),
        lines,
    )


def error_table(rows: Sequence[SweepRow]) -> Table:
    """Return percentiles of errors and torques of the feasible crossings."""
    figures: tuple[tuple[str, Callable[[SweepRow], float | None], str], ...] = (
        ("peak error", lambda row: row.error_peak, "m"),
        ("final error", lambda row: row.error_final, "m"),
        ("torque asked for", lambda row: row.requested, "Nm"),
        ("torque applied", lambda row: row.applied, "Nm"),
        ("samples over the limit", lambda row: row.saturated, ""),
    )
    lines: list[Line] = []
    for title, figure, unit in figures:
        for controller in controllers_of(rows):
            known = [value for row in runs_of(rows, controller, FEASIBLE) if (value := figure(row)) is not None]
            marks = np.percentile(known, PERCENTILES).tolist() if known else [None] * len(PERCENTILES)
            lines.append((title, controller, *(_figure(mark, unit) for mark in marks)))
    names = ("largest" if mark == 100.0 else f"{mark:g} %" for mark in PERCENTILES)
    note = "Percentiles over the feasible crossings, including the failed ones."
    return table("errors", "Errors and torques", note, ("figure", "controller", *names), lines)


def equipment_table(rows: Sequence[SweepRow]) -> Table:
    """Return success by encoders and delay."""
    kinds = [(counts, delay) for counts in ENCODERS for delay in DELAYS]
    if any(row.rig for row in rows):
        kinds = list(dict.fromkeys((row.encoder_counts, row.delay_samples) for row in rows))
    lines: list[Line] = []
    for controller in controllers_of(rows):
        runs = runs_of(rows, controller, FEASIBLE)
        line: list[Entry] = [controller]
        for kind in kinds:
            good, everything = rate_of([row for row in runs if (row.encoder_counts, row.delay_samples) == kind])
            line.append(Cell(f"{good} of {everything}", [good, everything], None if good == everything else False))
        lines.append(line)
    names = (f"{'exact' if counts is None else counts}, delay {delay}" for counts, delay in kinds)
    note = "Successes of the feasible crossings."
    return table("equipment", "By encoder counts and delay", note, ("controller", *names), lines)


def refusals_table(rows: Sequence[SweepRow]) -> Table:
    """Return why cases were refused by the planner, or screened out, and how often."""
    planner = Counter(planner_reason(row.reason) for row in rows if row.status == REFUSED)
    lines = [("planner", "all", reason, count) for reason, count in planner.most_common()]
    for controller in controllers_of(rows):
        out = runs_of(rows, controller, SCREENED_OUT)
        # a reason begins with the name of its figure
        names = Counter(part.partition(" is ")[0] for row in out for part in row.reason.split("; "))
        lines += [("screen", controller, name, count) for name, count in names.most_common()]
    note = "A case that breaks several limits of the screen counts for each."
    return table("refusals", "What was refused, and why", note, ("by", "for", "reason", "cases"), lines)


def planner_reason(text: str) -> str:
    """Return what kind of refusal a text is."""
    return next((words for phrase, words in PLANNER_REASONS.items() if phrase in text), "other")


def failures_table(rows: Sequence[SweepRow]) -> Table:
    """Return how feasible runs failed, by their worst shortcoming."""
    lines = []
    for controller in controllers_of(rows):
        kinds = Counter(kind_of(row) for row in runs_of(rows, controller, FEASIBLE) if not row.success)
        lines += [(controller, kind, count) for kind, count in kinds.most_common()]
    return table("failures", "How feasible crossings failed", "", ("controller", "what happened", "runs"), lines)


def kind_of(row: SweepRow) -> str:
    """Return what kind of failure a run is."""
    if row.fault:
        return f"fault {row.fault}"
    if row.mode_changes != row.crossings:
        return "wrong changes of assembly mode"
    return "errors only"


def explanations_table(explanations: Sequence[Explanation], command: Callable[[int], str]) -> Table:
    """Return the failures of the counted controller one by one; `command` gives the command that repeats a case."""
    lines: list[Line] = []
    for explanation in explanations:
        row = explanation.row
        encoders = "exact sensors" if row.encoder_counts is None else f"{row.encoder_counts} counts"
        equipment = Cell(f"{encoders}, delay {row.delay_samples}", [row.encoder_counts, row.delay_samples])
        duration, authority = Cell(f"{row.duration:.2f} s", row.duration), _figure(row.authority, "")
        scales = [row.mass_scale, row.inertia_scale, row.friction_scale]
        scaled = Cell(", ".join(f"{scale:.2f}" for scale in scales), scales)
        told = Cell(explanation.text, explanation.text, False)
        lines.append((row.case, equipment, duration, authority, scaled, told, command(row.case)))
    return table(
        "explanations",
        "Every failure among the feasible crossings",
        "Each was repeated with one condition changed at a time.",
        ("case", "equipment", "duration", "|n.v1|", "mass, inertia, friction", "what happened", "look at it"),
        lines,
    )


def share_of(good: int, everything: int, met: bool | None = None) -> Cell:
    """Return a share, rounded down; a dash for none."""
    if not everything:
        return Cell("–", None)
    # rounded down: 99.996 % are not 100 %
    return Cell(f"{np.floor(1e4 * good / everything) / 100.0:.2f} %", good / everything, met)


def interval_of(some: int, everything: int) -> Cell:
    """Return the interval of a share for 95 %, rounded outwards; a dash for none."""
    if not everything:
        return Cell("–", None)
    low, high = clopper_pearson(some, everything)
    # outwards, so that nothing is claimed that does not hold
    return Cell(f"{np.floor(1e4 * low) / 100.0:.2f} to {np.ceil(1e4 * high) / 100.0:.2f} %", [low, high])


def share_words(some: int, everything: int, decimals: int = 1) -> str:
    """Return how many of all, with the interval of their share for 95 %, as printed tables of studies have it."""
    low, high = clopper_pearson(some, everything)
    return f"{some} of {everything} ({100.0 * low:.{decimals}f} to {100.0 * high:.{decimals}f} %)"


def _figure(value: float | None, unit: str) -> Cell:
    if value is None:
        return Cell("–", None)
    if unit == "m":
        return Cell(error_of(value, unit), value)
    return Cell(plain(value, unit) if unit else f"{value:.3g}", value)
