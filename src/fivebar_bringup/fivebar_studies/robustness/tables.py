# SPDX-License-Identifier: Apache-2.0
"""The tables of the study.

Of the middle crossing they have the first failures, their causes and errors, and what was compared; of random crossings
what was injected and what became of it.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from fivebar_bringup.odds.misfit_limits import alarm_rate
from fivebar_bringup.odds.odds import clopper_pearson, upper_bound
from fivebar_bringup.pages.content import Cell, Line, Table, table
from fivebar_description.rounding import in_millimetres
from fivebar_studies.robustness.effects import Effect
from fivebar_studies.robustness.equipment import equipment_named
from fivebar_studies.robustness.running import FAR, NOTICED, REFUSED, SILENT, SURVIVED, RobustnessRow, failure_rule
from fivebar_studies.robustness.sensor_effects import ALL_EFFECTS, FAULTS, is_wrong_name
from fivebar_studies.sweep.drawing import ROBOT


class Climb(NamedTuple):
    """The results of an equipment as an effect grew.

    Attributes:
        effect, equipment: names.
        runs: at each size.
        failed: runs that failed at each size.
        causes: of each size, how often each cause came, the most frequent first.
        errors: of each size, the largest distance from the reference (m) of runs that are neither stopped nor end in
            the wrong assembly mode; None without any.
    """

    effect: str
    equipment: str
    runs: int
    failed: tuple[int, ...]
    causes: tuple[Mapping[str, int], ...]
    errors: tuple[float | None, ...] = ()

    @property
    def first(self) -> int | None:
        """Number of the first size at which a run fails."""
        return first_failure(self.failed)

    @property
    def first_size(self) -> float | None:
        """The first size at which a run fails, None if none does."""
        return None if self.first is None else ALL_EFFECTS[self.effect].sizes[self.first]


def first_failure(failed: Sequence[int]) -> int | None:
    """Return the first step with a failure, None without one."""
    return next((step for step, count in enumerate(failed) if count), None)


def climbs_of(rows: Sequence[RobustnessRow]) -> list[Climb]:
    """Return what became of every pair of effect and equipment."""
    sizes: dict[tuple[str, str], dict[float, list[RobustnessRow]]] = {}
    for row in rows:
        if row.effect:
            sizes.setdefault((row.effect, row.equipment), {}).setdefault(row.size, []).append(row)
    climbs = []
    for pair, steps in sizes.items():
        causes = [Counter(row.cause for row in runs if row.cause) for runs in steps.values()]
        climbs.append(
            Climb(
                *pair,
                max(map(len, steps.values())),
                tuple(counts.total() for counts in causes),
                tuple(dict(counts.most_common()) for counts in causes),
                tuple(largest_error(runs) for runs in steps.values()),
            )
        )
    return climbs


def largest_error(rows: Sequence[RobustnessRow]) -> float | None:
    """Return the largest distance (m) from the reference of runs that are neither stopped nor in the wrong mode."""
    return max((row.error for row in rows if row.cause in ("", FAR)), default=None)


def failures_without(rows: Sequence[RobustnessRow]) -> dict[str, int]:
    """Return how many runs of each equipment fail on the exact robot."""
    failed: dict[str, int] = {}
    for row in rows:
        if not row.effect:
            failed[row.equipment] = failed.get(row.equipment, 0) + bool(row.cause)
    return failed


def first_failures(climbs: Sequence[Climb], robot: str = ROBOT) -> Table:
    """Return the size at which each equipment first fails, an effect a row.

    An entry is good where even a middling robot has less of the effect, bad where a good one has as much.
    """
    used = list(dict.fromkeys(climb.equipment for climb in climbs))
    of = {(climb.effect, climb.equipment): climb for climb in climbs}
    rows = []
    for name in dict.fromkeys(climb.effect for climb in climbs):
        effect = ALL_EFFECTS[name]
        words = f"{effect.words} ({effect.unit})" if effect.unit else effect.words
        of_effect = [of.get((name, equipment)) for equipment in used]
        first = [Cell("", None) if climb is None else _first(effect, climb) for climb in of_effect]
        rows.append((Cell(words, name), _typical(effect.good), _typical(effect.middling), *first))
    return table(
        "first",
        "Where each controller first fails",
        f"Smallest size at which one of the runs fails: {failure_rule(robot)}. A dash: at no size, up to the one behind"
        " it. Green: even a middling robot has less; red: a good robot has as much. Each effect alone, on a robot that"
        " is otherwise exact.",
        ("effect", "good robot", "middling robot", *used),
        rows,
    )


def causes_table(climbs: Sequence[Climb]) -> Table:
    """Return how the runs failed at the first size with a failure, and at the largest."""
    rows: list[Line] = []
    for climb in climbs:
        if climb.first is None:
            continue
        causes = [
            ", ".join(f"{cause} {count}" for cause, count in climb.causes[step].items()) or "none"
            for step in (climb.first, -1)
        ]
        rows.append((climb.effect, climb.equipment, *causes, climb.runs))
    columns = ("effect", "controller", "first failures", "failures at the largest size", "of runs")
    return table("causes", "How they fail", "", columns, rows, folded=True)


def errors_table(rows: Sequence[RobustnessRow], climbs: Sequence[Climb]) -> Table:
    """Return the largest error of each burst, an effect and an equipment a row."""
    lengths = sorted({size for climb in climbs for size in ALL_EFFECTS[climb.effect].sizes})
    lines: list[Line] = []
    for climb in climbs:
        sound = [row for row in rows if not row.effect and row.equipment == climb.equipment]
        errors = {0.0: largest_error(sound), **dict(zip(ALL_EFFECTS[climb.effect].sizes, climb.errors, strict=True))}
        cells = [_error(errors.get(length)) for length in (0.0, *lengths)]
        lines.append((climb.effect, climb.equipment, *cells))
    words = (
        "By how many are lost in a row: largest error of all moments at which the burst begins. Empty: not tried, or"
        " every run is stopped or ends in the wrong assembly mode."
    )
    columns = ("lost", "controller", "none", *(f"{length:g}" for length in lengths))
    return table("errors", "Largest error", words, columns, lines)


def _error(error: float | None) -> Cell:
    return Cell("", None) if error is None else Cell(in_millimetres(error), error)


def equipment_table(baseline: dict[str, int]) -> Table:
    """Return what the names of the controllers stand for, and how many runs without any effect failed."""
    rows = ((name, equipment_named(name).words, failed) for name, failed in baseline.items())
    return table("equipment", "What is compared", "", ("controller", "it has", "failures without any effect"), rows)


def _typical(size: float | None) -> Cell:
    return Cell("0" if size is None else f"{size:g}", size)


def _first(effect: Effect, climb: Climb) -> Cell:
    size = climb.first_size
    if size is None:
        return Cell(f"– ({effect.sizes[-1]:g})", None, True)
    if effect.good is not None and not worse(effect, size, effect.good):
        return Cell(f"{size:g}", size, False)
    return Cell(f"{size:g}", size, True if effect.middling is None or worse(effect, size, effect.middling) else None)


def worse(effect: Effect, size: float, other: float) -> bool:
    """Return whether a size is more of an effect than another."""
    return size < other if effect.falls else size > other


def confusion_table(rows: Sequence[RobustnessRow]) -> Table:
    """Return what was injected against what became of it: survived, silent, and each name."""
    runs = [row for row in rows if row.verdict != REFUSED]
    named = Counter(row.named for row in runs if row.named)
    names = [name for name, _ in named.most_common()]
    lines = []
    for controller, fault in itertools.product(dict.fromkeys(row.equipment for row in runs), ("", *FAULTS)):
        mine = [row for row in runs if (row.equipment, row.effect) == (controller, fault)]
        counts = Counter(row.named for row in mine)
        words = FAULTS[fault].words if fault else "no fault"
        lines.append(
            (
                Cell(controller, controller),
                Cell(words, fault),
                _count(len(mine)),
                _count(sum(row.verdict == SURVIVED for row in mine)),
                _count(silent := sum(row.verdict == SILENT for row in mine), None if silent == 0 else False),
                *(_count(counts[name], _is_good(fault, name, counts[name])) for name in names),
            )
        )
    return Table(
        "confusion",
        "Injected against named",
        "Runs by the fault that was injected, and by what became of them. Red: silent, or the name of another cause.",
        ("controller", "injected", "runs", "survived", "silent", *names),
        tuple(lines),
    )


def _count(number: int, good: bool | None = None) -> Cell:
    return Cell(f"{number}" if number else "", number, good)


def _is_good(fault: str, named: str, number: int) -> bool | None:
    return False if number and (is_wrong_name(fault, named) or not fault) else None


def totals(rows: Sequence[RobustnessRow]) -> dict[str, Any]:
    """Return how many runs are silent, wrongly named or false alarms, with the intervals for 95 %."""
    faulty = [row for row in rows if row.verdict != REFUSED and row.effect]
    sound = [row for row in rows if row.verdict != REFUSED and not row.effect]
    figures: dict[str, Any] = {}
    for name, runs, count in (
        ("silent", len(faulty), sum(row.verdict == SILENT for row in faulty)),
        ("wrongly_named", len(faulty), sum(is_wrong_name(row.effect, row.named) for row in faulty)),
        ("false_alarms", len(sound), sum(row.verdict == NOTICED for row in sound)),
    ):
        low, high = clopper_pearson(count, runs) if runs else (0.0, 1.0)
        bound = upper_bound(count, runs) if runs else 1.0
        figures[name] = {"runs": runs, "count": count, "interval_95": [low, high], "upper_bound_95": bound}
    rate = alarm_rate(uses_by_crossing(sound))
    figures["false_alarms"]["by_fitted_tail"] = None if rate is None else rate._asdict()
    return figures


def uses_by_crossing(sound: Iterable[RobustnessRow]) -> list[list[float]]:
    """Return the shares of a limit that sound runs reach, those of a crossing together."""
    by_size: dict[int, list[float]] = {}
    for row in sound:
        by_size.setdefault(row.case, []).append(row.use)
    return [*by_size.values()]
