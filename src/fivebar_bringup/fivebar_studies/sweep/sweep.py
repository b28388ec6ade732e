# SPDX-License-Identifier: Apache-2.0
"""Definition of the study of random crossings, its tables and its page."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote
from typing import Any

from pydantic import field_validator

from fivebar_bringup.odds.odds import success_rule
from fivebar_bringup.pages.rendering import render
from fivebar_control.compiling import expect_many_motions
from fivebar_control.laws.registry import controller_problem
from fivebar_control.trajectory.path_distance import TIMED
from fivebar_description.modules import modules_unopened
from fivebar_studies.engine.program import program_digest
from fivebar_studies.engine.study import Study, StudyReport, StudySettings
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.rigs.rig import OF_ROBOT, REQUIRED, SET
from fivebar_studies.sweep import drawing
from fivebar_studies.sweep.drawing import BASES, VARIED
from fivebar_studies.sweep.explanations import explained
from fivebar_studies.sweep.rows import FEASIBLE, REFUSED, ROWS, SweepRow
from fivebar_studies.sweep.running import SWEPT, counted, run_case
from fivebar_studies.sweep.statistics import (
    branch_table,
    equipment_table,
    error_table,
    explanations_table,
    failures_table,
    odds_table,
    overview_table,
    rate_of,
    refusals_table,
    runs_of,
    silence_table,
    within_table,
)

MOST_DRAWS = 100
"""Largest ratio of drawn cases to requested crossings."""


DECIDING = tuple(f"fivebar_studies/sweep/{module}.py" for module in ("drawing", "planning", "rows", "running"))
"""Files that decide the rows besides those of every study."""


class SweepSettings(StudySettings):
    """The settings that determine the rows of a sweep.

    Attributes:
        seed: of all cases.
        cases: crossings judged feasible for the controller that counts (:func:`counted`) after which the sweep is done.
        rig: whose robots are drawn, "" for none.
        controllers: that make each crossing.
        robot: whose crossings are drawn, by the name of its file; "" for that of the rig.
    """

    seed: int = 1
    cases: int = 2000
    rig: str = VARIED
    controllers: tuple[str, ...] = SWEPT
    robot: str = ""

    @field_validator("controllers")
    @classmethod
    def _known(cls, names: tuple[str, ...]) -> tuple[str, ...]:
        """Refuse none, and one that is not known; a law from elsewhere is loaded where it runs."""
        if not names:
            raise ValueError("expected at least one")
        with modules_unopened():
            for name in names:
                problem = controller_problem(name)
                if problem is not None:
                    raise ValueError(f"{name!r}: {problem}")
        return names


def run_numbered(settings: SweepSettings, number: int) -> list[SweepRow]:
    """Return the rows of a case of a sweep."""
    expect_many_motions()
    return run_case(settings.seed, number, settings.rig, settings.controllers, settings.robot)


def _program(settings: SweepSettings) -> str:
    rigs = (settings.rig,) if settings.rig else BASES
    return program_digest(DECIDING, (settings.robot,) if settings.robot else (), rigs, settings.controllers)


def _feasible(settings: SweepSettings, rows: Sequence[SweepRow]) -> int:
    return len(runs_of(rows, counted(settings.controllers), FEASIBLE))


def command_of(settings: SweepSettings) -> str:
    """Return the command that repeats a sweep."""
    return f"{_of_cases(settings)} --cases {settings.cases}"


def _of_cases(settings: SweepSettings) -> str:
    """Return the command of a sweep, without the number of its cases."""
    words = [f"fivebar sweep --seed {settings.seed}"]
    rig, *changes = settings.rig.split(SET)
    declared = rig.removeprefix(OF_ROBOT) if rig.startswith(OF_ROBOT) else ""
    words += [f"--rig {quote(rig)}"] if rig and not declared else []
    words += [f"--set {quote(change)}" for change in changes]
    words += [f"--robot {quote(settings.robot or declared)}"] if settings.robot or declared else []
    return " ".join([*words, *settings.options("controllers")])


def sweep_report(settings: SweepSettings, rows: Sequence[SweepRow]) -> StudyReport:
    """Return the tables, figures and page of a sweep."""
    # here, because workers need no matplotlib
    from fivebar_studies.sweep.figures import sweep_figures

    explanations = [explained(row) for row in runs_of(rows, counted(settings.controllers), FEASIBLE) if not row.success]
    required = find_rig(settings.rig).required if settings.rig else REQUIRED
    overview = overview_table(rows, required)
    tables = [
        overview,
        odds_table(rows),
        branch_table(rows),
        within_table(rows),
        silence_table(rows),
        error_table(rows),
        equipment_table(rows),
    ]
    of_rig = f"rig {settings.rig} · " if settings.rig else ""
    of_cases = _of_cases(settings)
    details = [
        explanations_table(explanations, lambda number: f"{of_cases} --case {number}"),
        failures_table(rows),
        refusals_table(rows),
    ]
    met, verdict = _verdict(settings, rows, counted(settings.controllers), required)
    drawn = len({row.case for row in rows})
    runs = sum(row.status != REFUSED for row in rows)
    content: dict[str, Any] = {
        "drawn": drawn,
        "runs": runs,
        "met": met,
        "verdict": verdict,
        "tables": [table.as_json() for table in (*tables, *details[1:])],
        "failures": [explanation.as_json() for explanation in explanations],
    }
    pictures = sweep_figures(rows)
    page = render(
        "sweep.html",
        package="fivebar_studies",
        title="Random crossings",
        setting=f"{of_rig}seed {settings.seed} · {drawn} cases drawn, {runs} runs, all simulated",
        drawn=_drawn_words(settings),
        met=met,
        verdict=verdict,
        tables=tables,
        pictures=pictures,
        details=details,
        command=command_of(settings),
    )
    return StudyReport(page, content, pictures, overview)


def _verdict(settings: SweepSettings, rows: Sequence[SweepRow], controller: str, required: float) -> tuple[bool, str]:
    feasible = runs_of(rows, controller, FEASIBLE)
    good, everything = rate_of(feasible)
    by_branch = {
        branch: rate_of([row for row in feasible if row.distal_links == branch])
        for branch in sorted({row.distal_links for row in feasible}, reverse=True)
    }
    branches = "; ".join(
        f"{succeeded} of {count} with distal links {branch}" for branch, (succeeded, count) in by_branch.items()
    )
    text = (
        f"{controller} completed {good} of the {everything} crossings that were judged feasible before the run"
        f"{f' ({branches})' if branches else ''}; required are {100.0 * required:g} %. Success means:"
        f" {success_rule(rows[0].draw.size, _judge(settings))}."
    )
    return good >= required * everything, text


def _judge(settings: SweepSettings) -> str:
    """Return by what the runs of a sweep are judged."""
    return str(find_rig(settings.rig).scenario.get("judge", TIMED)) if settings.rig else TIMED


def _drawn_words(settings: SweepSettings) -> str:
    rig = settings.rig
    robot = settings.robot or drawing.robot_of(rig)
    encoders = ", ".join(
        "none, with exact sensors" if encoder is None else f"{encoder}" for encoder in drawing.ENCODERS
    )
    robots = (
        f"mass, inertia and friction each within {100.0 * drawing.SPREAD:g} % of the controllers' model; encoder counts"
        f" {encoders} (on the motors only, with estimator and torque in steps of"
        f" {1e3 * drawing.torque_step_of(robot):.3g} mNm);"
        " delay of 0 or 1 sample"
    )
    if rig:
        robots = f"robots of the rig {rig}: {find_rig(rig).described} Besides"
    return (
        f"Straight segments of the robot {robot} between two random rest points in different assembly modes, in"
        f" each of the four working modes; {drawing.SHORTEST:g} to {drawing.LONGEST:g} s, evenly on a logarithmic"
        f" scale; {robots}; torque limit {drawing.torque_limit_of(robot):g} Nm, {drawing.RATE_HZ} samples/s;"
        f" unified with weight {drawing.weight_of(rig, settings.robot):.3g}. Every case that the planner accepts is"
        " run, also those that a controller's screen judges infeasible."
    )


SWEEP = Study(
    name="sweep",
    place=f"{__name__}:SWEEP",
    settings=SweepSettings,
    table=ROWS,
    run=run_numbered,
    cases=lambda settings: MOST_DRAWS * settings.cases,
    chunk=lambda settings: 10,
    report=sweep_report,
    program=_program,
    command=command_of,
    wanted=lambda settings: settings.cases,
    counts=_feasible,
)
"""The study of random crossings; it draws a whole number of chunks."""
