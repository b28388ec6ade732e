"""Definition of the study, its tables and its page."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote
from typing import Any

from fivebar_bringup.pages.rendering import study_page
from fivebar_bringup.studies.engine.program import program_digest
from fivebar_bringup.studies.engine.study import Study, StudyReport
from fivebar_bringup.studies.engine.table import RowTable
from fivebar_bringup.studies.robustness.running import (
    ENCODERS,
    Climb,
    RobustnessRow,
    RobustnessSettings,
    climbs_of,
    failure_rule,
    failures_without,
    run_numbered,
    steps_of,
)
from fivebar_bringup.studies.robustness.sensor_effects import ALL_EFFECTS
from fivebar_bringup.studies.robustness.tables import causes_table, equipment_table, first_failures
from fivebar_bringup.studies.sweep.sweep import DECIDING

QUICK: dict[str, Any] = {"draws": 2, "durations": (1.0,)}
"""Settings of the quick study."""

RIGS = ENCODERS, "good", "middling"
"""Rigs whose sensors, estimators and gains are compared."""

WORDS = (
    "One effect at a time grows on a simulated robot that is otherwise exact, with motor encoders of 20 000 counts,"
    " torque in small steps, a sample of delay and its own drives. It makes one motion, the middle crossing, in"
    " proportion to its size. A real robot has all effects at once, so it needs a distance from these figures. Good and"
    " middling robots are those of the rigs of DexTAR."
)


def robustness_report(settings: RobustnessSettings, rows: Sequence[RobustnessRow]) -> StudyReport:
    """Return tables, figures and page."""
    # here, because workers need no matplotlib
    from fivebar_bringup.studies.robustness.figures import share_figures

    climbs, baseline = climbs_of(settings, rows), failures_without(rows)
    first = first_failures(climbs, settings.robot)
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
    durations = ", ".join(f"{one:g}" for one in settings.durations)
    page = study_page(
        title="What must a robot be like?",
        setting=f"{settings.robot} · middle crossing in {durations} s · {settings.draws} draws each · compiled engine",
        command=command,
        tables=[first, equipment_table(baseline)],
        words=WORDS,
        pictures=pictures,
        details=[causes_table(climbs)],
    )
    return StudyReport(page, content, pictures, first)


def command_of(settings: RobustnessSettings) -> str:
    """Return the command that repeats the study."""
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
        "first_failure": climb.first_size,
    }


ROBUSTNESS = Study(
    name="robustness",
    place=f"{__name__}:ROBUSTNESS",
    settings=RobustnessSettings,
    table=RowTable(RobustnessRow),
    run=run_numbered,
    cases=lambda settings: len(steps_of(settings)),
    chunk=100,
    report=robustness_report,
    program=lambda settings: program_digest(
        (*DECIDING, *(f"studies/robustness/{module}.py" for module in ("effects", "sensor_effects", "running"))),
        (settings.robot,),
        RIGS,
        settings.controllers,
    ),
    command=command_of,
)
"""The study of effects that grow."""
