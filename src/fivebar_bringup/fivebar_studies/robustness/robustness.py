# SPDX-License-Identifier: Apache-2.0
"""Definition of the study, its tables and its page."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote
from typing import Any

from fivebar_bringup.pages.rendering import study_page
from fivebar_studies.engine.program import program_digest
from fivebar_studies.engine.study import Study, StudyReport
from fivebar_studies.engine.table import RowTable
from fivebar_studies.robustness.effects import BURSTS
from fivebar_studies.robustness.equipment import ENCODERS
from fivebar_studies.robustness.running import RobustnessRow, RobustnessSettings, failure_rule, run_numbered, runs_of
from fivebar_studies.robustness.sensor_effects import ALL_EFFECTS
from fivebar_studies.robustness.tables import (
    Climb,
    causes_table,
    climbs_of,
    confusion_table,
    equipment_table,
    errors_table,
    failures_without,
    first_failures,
    totals,
)
from fivebar_studies.sweep.sweep import DECIDING

QUICK: dict[str, Any] = {"draws": 2, "durations": (1.0,)}
"""Settings of the quick study."""

RIGS = ENCODERS, "good", "middling"
"""Rigs whose sensors, estimators and gains are compared."""

OF_MIDDLE = (
    "One effect at a time grows on a simulated robot that is otherwise exact, with motor encoders of 20 000 counts,"
    " torque in small steps, a sample of delay and its own drives. It makes one motion, the middle crossing, in"
    " proportion to its size. A real robot has all effects at once, so it needs a distance from these figures. Good and"
    " middling robots are those of the rigs of DexTAR."
)

OF_RANDOM = (
    "Random crossings that the planner accepts, of several robots of a rig each: without faults, and once with every"
    " fault of a sensor, of a random size, from a random moment on. A run is silent that leaves its reference by 5 mm,"
    " or ends in the wrong assembly mode, without a fault within 50 ms. Names without a cause, such as"
    " estimate_inconsistent and tracking_lost, are never wrong."
)


def robustness_report(settings: RobustnessSettings, rows: Sequence[RobustnessRow]) -> StudyReport:
    """Return tables, figures and page."""
    return _random_report(settings, rows) if settings.rig else _middle_report(settings, rows)


def _middle_report(settings: RobustnessSettings, rows: Sequence[RobustnessRow]) -> StudyReport:
    # here, because workers need no matplotlib
    from fivebar_studies.robustness.figures import share_figures

    climbs, baseline = climbs_of(rows), failures_without(rows)
    first = first_failures(climbs, settings.robot)
    bursts = [climb for climb in climbs if climb.effect in BURSTS]
    command = command_of(settings)
    content = {
        "command": command,
        "durations_s": settings.durations,
        "draws": settings.draws,
        "fails": failure_rule(settings.robot),
        "failures_without_effects": baseline,
        "first": first.as_json()["rows"],
        "climbs": [_as_json(climb) for climb in climbs],
    }
    pictures = share_figures(climbs)
    durations = ", ".join(f"{duration:g}" for duration in settings.durations)
    page = study_page(
        title="What must a robot be like?",
        setting=f"{settings.robot} · middle crossing in {durations} s · {settings.draws} draws each · compiled engine",
        command=command,
        tables=[first, *([errors_table(rows, bursts)] if bursts else []), equipment_table(baseline)],
        words=OF_MIDDLE,
        pictures=pictures,
        details=[causes_table(climbs)],
    )
    return StudyReport(page, content, pictures, first)


def _random_report(settings: RobustnessSettings, rows: Sequence[RobustnessRow]) -> StudyReport:
    confusion, counts = confusion_table(rows), totals(rows)
    command = command_of(settings)
    shares = "; ".join(
        f"{name.replace('_', ' ')} {count['count']} of {count['runs']}, below {count['upper_bound_95']:.2%} (95 %)"
        for name, count in counts.items()
    )
    page = study_page(
        title="Are faults of sensors noticed?",
        setting=f"rig {settings.rig} · {shares} · simulated by the compiled engine",
        command=command,
        tables=[confusion],
        words=OF_RANDOM,
    )
    return StudyReport(page, {"command": command, **counts, "confusion": confusion.as_json()["rows"]}, [], confusion)


def command_of(settings: RobustnessSettings) -> str:
    """Return the command that repeats the study."""
    if settings.rig:
        random = f"fivebar robustness --rig {quote(settings.rig)} --cases {settings.cases} --seed {settings.seed}"
        return " ".join([random, *settings.options("controllers")])
    usual, words = RobustnessSettings(), ["fivebar robustness"]
    words += [f"--robot {quote(settings.robot)}"] if settings.robot != usual.robot else []
    words += ["--quick"] if settings.draws == QUICK["draws"] else []
    return " ".join([*words, *settings.options("effects", "controllers")])


def _as_json(climb: Climb) -> dict[str, Any]:
    effect = ALL_EFFECTS[climb.effect]
    return {
        "effect": climb.effect,
        "controller": climb.equipment,
        "unit": effect.unit,
        "sizes": effect.sizes,
        "runs": climb.runs,
        "failed": climb.failed,
        "causes": climb.causes,
        "errors_m": climb.errors,
        "first_failure": climb.first_size,
    }


ROBUSTNESS = Study(
    name="robustness",
    place=f"{__name__}:ROBUSTNESS",
    settings=RobustnessSettings,
    table=RowTable(RobustnessRow),
    run=run_numbered,
    cases=lambda settings: settings.cases if settings.rig else len(runs_of(settings)),
    chunk=lambda settings: 1 if settings.rig else 100,
    report=robustness_report,
    program=lambda settings: program_digest(
        (
            *DECIDING,
            *(
                f"fivebar_studies/robustness/{module}.py"
                for module in ("effects", "equipment", "running", "sensor_effects")
            ),
        ),
        (settings.robot,),
        (settings.rig,) if settings.rig else RIGS,
        settings.compared,
    ),
    command=command_of,
)
"""The study of what a robot with faults survives."""
