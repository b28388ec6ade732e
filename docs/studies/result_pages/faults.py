# SPDX-License-Identifier: Apache-2.0
"""The page of the faults of a robot: each alone, up to the size at which a crossing fails."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import NamedTuple

from matplotlib.figure import Figure

from fivebar_studies.engine.running import FinishedStudy
from fivebar_studies.engine.table import RowTable
from fivebar_studies.robustness.figures import share_figure
from fivebar_studies.robustness.robustness import QUICK
from fivebar_studies.robustness.sensor_effects import ALL_EFFECTS, SENSOR_EFFECTS
from fivebar_studies.robustness.tables import Climb
from result_pages.page import ResultPage, StudyRun, TextTable

STUDY = "fivebar_studies.robustness.robustness:ROBUSTNESS"

OF_SENSORS = {"effects": tuple(SENSOR_EFFECTS), "controllers": ("unified", "multi_cartesian")}

RUNS = (StudyRun("robustness", STUDY, {}, QUICK), StudyRun("robustness_sensors", STUDY, OF_SENSORS, QUICK))

SHOWN = (
    "unified, encoders",
    "unified, gyro",
    "multi_cartesian, gyro",
)
"""Columns of the table; the CSV has all."""

DRAWN = ("unified, encoders", "unified, gyro", "unified, gyro, elastic")
"""Panels of the figure."""


class FaultRow(NamedTuple):
    """A line of faults.csv: what became of the runs at a size of an effect.

    Attributes:
        run: that made it.
        effect: its name.
        unit: of the size.
        size: of the effect.
        equipment: law, sensors and settings.
        runs: how many there were.
        failed: of these.
        causes: why, and how often each.
    """

    run: str
    effect: str
    unit: str
    size: float
    equipment: str
    runs: int
    failed: int
    causes: str


def fault_rows(run: str, finished: FinishedStudy) -> list[FaultRow]:
    """Return the rows of the study."""
    rows = []
    for climb in finished.content["climbs"]:
        for size, failed, causes in zip(climb["sizes"], climb["failed"], climb["causes"], strict=True):
            words = ", ".join(f"{cause} {count}" for cause, count in causes.items())
            given = climb["effect"], climb["unit"], float(size), climb["controller"], climb["runs"], failed
            rows.append(FaultRow(run, *given, words))
    return rows


def climbs_of_rows(rows: Sequence[FaultRow]) -> list[Climb]:
    """Return what became of every pair of effect and equipment, without the causes."""
    found: dict[tuple[str, str], list[FaultRow]] = {}
    for row in rows:
        found.setdefault((row.effect, row.equipment), []).append(row)
    return [
        Climb(*pair, steps[0].runs, tuple(step.failed for step in steps), tuple({} for _ in steps))
        for pair, steps in found.items()
    ]


def faults_table(rows: Sequence[FaultRow]) -> TextTable:
    """Return the smallest size at which a run fails, an effect a line."""
    of = {(climb.effect, climb.equipment): climb for climb in climbs_of_rows(rows)}
    shown = [name for name in SHOWN if any(equipment == name for _, equipment in of)]
    lines = []
    for name in dict.fromkeys(row.effect for row in rows):
        effect = ALL_EFFECTS[name]
        entries = [effect.words, effect.shown(effect.good), effect.shown(effect.middling)]
        for equipment in shown:
            none = f"– ({effect.shown(effect.sizes[-1])})"
            entries.append(first_failing(of.get((name, equipment)), effect.shown, none))
        lines.append(entries)
    return TextTable(("one effect alone", "good robot", "middling robot", *shown), lines)


def first_failing(climb: Climb | None, shown: Callable[[float], str], none: str = "–") -> str:
    """Return the smallest size at which a run fails, as it is shown; "" without runs, and `none` where no run fails."""
    if climb is None:
        return ""
    return none if climb.first_size is None else shown(climb.first_size)


def _survived(rows: Sequence[FaultRow], effect: str, equipment: str) -> str:
    """Return the largest size before the first failure."""
    (climb,) = (one for one in climbs_of_rows(rows) if (one.effect, one.equipment) == (effect, equipment))
    sizes = ALL_EFFECTS[effect].sizes
    first = len(sizes) if climb.first is None else climb.first
    return ALL_EFFECTS[effect].shown(sizes[first - 1]) if first else "less than " + ALL_EFFECTS[effect].shown(sizes[0])


GEOMETRY = {
    "lengths": "links off by {}",
    "zeros": "encoder zeros off by {}",
    "elasticity": "transmissions of {}",
    "backlash": "backlash of {}",
}
LOADS = {
    "push": "a push of {}",
    "passive": "{} in each passive joint",
    "drag": "a cable that pulls with {}",
}
TABLE = {
    "vibration": "that vibrates by {} at 15 Hz",
    "tilt": "that is tilted by {}",
}
"""Effects in words, with a place for their size."""


def _answer(rows: Sequence[FaultRow]) -> str:
    def of(equipment: str, words: Mapping[str, str]) -> str:
        parts = [one.format(_survived(rows, effect, equipment)) for effect, one in words.items()]
        return f"{', '.join(parts[:-1])} or {parts[-1]}"

    return (
        f"With motor encoders alone `unified` bears {of('unified, encoders', GEOMETRY)}. With a gyroscope on the distal"
        f" link and declared tolerances it bears {of('unified, gyro', GEOMETRY)}. Across the locus, where no motor"
        f" acts, it bears {of('unified, gyro', LOADS)}. It bears a table {of('unified, gyro', TABLE)}."
    )


def _figure(rows: Sequence[FaultRow]) -> Figure:
    return share_figure(list(DRAWN), climbs_of_rows(rows), "What unified survives")


FAULTS = ResultPage(
    name="faults",
    title="How large may each fault be?",
    question="how large may each fault of a robot be, alone, until a crossing fails?",
    runs=tuple(run.name for run in RUNS),
    table=RowTable(FaultRow),
    rows=fault_rows,
    answer=_answer,
    shown=faults_table,
    figure=_figure,
    caption="Share of the runs of `unified` that fail at each size, growing from left to right; blue and dark line: a"
    " good and a middling robot.",
    words="An entry is the smallest size at which one of the runs fails; a dash: none does, up to the size in"
    " brackets. [Robustness](../robustness.md) has the method, and what to do about each.",
    limits=(
        "Motions other than the middle crossing; other signs, phases and durations.",
        "More than one effect at a time. A robot has all of them, and they add up.",
    ),
)
