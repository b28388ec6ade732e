"""Definition of the study, the confusion table, and its page."""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Sequence
from shlex import quote
from typing import Any

from fivebar_bringup.odds.misfit_limits import alarm_rate
from fivebar_bringup.odds.odds import clopper_pearson, upper_bound
from fivebar_bringup.pages.content import Cell, Table
from fivebar_bringup.pages.rendering import study_page
from fivebar_bringup.studies.engine.program import program_digest
from fivebar_bringup.studies.engine.study import Study, StudyReport
from fivebar_bringup.studies.engine.table import RowTable
from fivebar_bringup.studies.sensor_faults.faults import FAULTS, is_wrong_name
from fivebar_bringup.studies.sensor_faults.running import (
    NOTICED,
    REFUSED,
    SILENT,
    SURVIVED,
    SensorFaultRow,
    SensorFaultSettings,
    run_numbered,
)
from fivebar_bringup.studies.sweep.sweep import DECIDING

SOUND = "no fault"

WORDS = (
    "Random crossings that the planner accepts, of several robots of a rig each: without faults, and once with every"
    " fault of a sensor, of a random size, from a random moment on. A run is silent that leaves its reference by 5 mm,"
    " or ends in the wrong assembly mode, without a fault within 50 ms. Names without a cause, such as"
    " estimate_inconsistent and tracking_lost, are never wrong."
)


def confusion_table(rows: Sequence[SensorFaultRow]) -> Table:
    """Return what was injected against what became of it: survived, silent, and each name."""
    runs = [row for row in rows if row.verdict != REFUSED]
    named = Counter(row.named for row in runs if row.named)
    names = [name for name, _ in named.most_common()]
    lines = []
    for controller, fault in itertools.product(dict.fromkeys(row.controller for row in runs), ("", *FAULTS)):
        mine = [row for row in runs if (row.controller, row.fault) == (controller, fault)]
        counts = Counter(row.named for row in mine)
        words = FAULTS[fault].words if fault else SOUND
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


def totals(rows: Sequence[SensorFaultRow]) -> dict[str, Any]:
    """Return how many runs are silent, wrongly named or false alarms, with the intervals for 95 %."""
    faulty = [row for row in rows if row.verdict != REFUSED and row.fault]
    sound = [row for row in rows if row.verdict != REFUSED and not row.fault]
    found: dict[str, Any] = {}
    for name, runs, count in (
        ("silent", len(faulty), sum(row.verdict == SILENT for row in faulty)),
        ("wrongly_named", len(faulty), sum(is_wrong_name(row.fault, row.named) for row in faulty)),
        ("false_alarms", len(sound), sum(row.verdict == NOTICED for row in sound)),
    ):
        low, high = clopper_pearson(count, runs) if runs else (0.0, 1.0)
        bound = upper_bound(count, runs) if runs else 1.0
        found[name] = {"runs": runs, "count": count, "interval_95": [low, high], "upper_bound_95": bound}
    rate = alarm_rate(uses_by_crossing(sound))
    found["false_alarms"]["by_fitted_tail"] = None if rate is None else rate._asdict()
    return found


def uses_by_crossing(sound: Iterable[SensorFaultRow]) -> list[list[float]]:
    """Return the shares of a limit that sound runs reach, those of a crossing together."""
    found: dict[int, list[float]] = {}
    for row in sound:
        found.setdefault(row.case, []).append(row.use)
    return [*found.values()]


def sensor_faults_report(settings: SensorFaultSettings, rows: Sequence[SensorFaultRow]) -> StudyReport:
    """Return table, totals and page."""
    table, found = confusion_table(rows), totals(rows)
    command = command_of(settings)
    shares = "; ".join(
        f"{name.replace('_', ' ')} {one['count']} of {one['runs']}, below {one['upper_bound_95']:.2%} (95 %)"
        for name, one in found.items()
    )
    page = study_page(
        title="Are faults of sensors noticed?",
        setting=f"rig {settings.rig} · {shares} · simulated by the compiled engine",
        command=command,
        tables=[table],
        words=WORDS,
    )
    content = {"command": command, **found, "confusion": table.as_json()["rows"]}
    return StudyReport(page, content, [], table)


def command_of(settings: SensorFaultSettings) -> str:
    """Return the command that repeats the study."""
    words = f"fivebar robustness --rig {quote(settings.rig)} --cases {settings.cases} --seed {settings.seed}"
    return " ".join([words, *settings.options("controllers")])


SENSOR_FAULTS = Study(
    name="sensor_faults",
    place=f"{__name__}:SENSOR_FAULTS",
    settings=SensorFaultSettings,
    table=RowTable(SensorFaultRow),
    run=run_numbered,
    cases=lambda settings: settings.cases,
    chunk=1,
    report=sensor_faults_report,
    program=lambda settings: program_digest(
        (*DECIDING, *(f"studies/sensor_faults/{module}.py" for module in ("faults", "running"))),
        (),
        (settings.rig,),
        settings.controllers,
    ),
    command=command_of,
)
"""The study of the faults of sensors."""
