# SPDX-License-Identifier: Apache-2.0
"""Subcommand that runs thousands of random crossings: sweep."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.table import Table
from rich.text import Text

from fivebar_bringup.cli.app import Group, JobsOption, JsonOption, SetOption, command, input_errors
from fivebar_bringup.cli.printing import Printer
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts
from fivebar_studies.cli.study_options import (
    Machines,
    SchedulerFileOption,
    SchedulerOption,
    StudyOutOption,
    chosen_controllers,
    controllers_option,
    run_command,
    show_study,
)

QUICK_CASES = 60

ALONE = ("--cases", "--quick", "--jobs", "--scheduler", "--scheduler-file")
"""Options without effect on a single case, which runs in this process."""

PLANNED_AT = "`fivebar simulate` with a scenario, since a sweep plans its motions at 500 Hz"
DRAWN = "`fivebar simulate` with a scenario, since a sweep draws its motions"

SHOWN = {
    "controller": "controller",
    "status": "status",
    "success": "success",
    "error_peak": "peak, m",
    "error_final": "final, m",
}
"""Columns of a single case on the terminal; the reasons come below."""


@command(Group.STUDY, former={"--controller": "--controllers"}, idle={"--case": ALONE})
def sweep(
    cases: Annotated[
        int | None,
        typer.Option(
            "--cases",
            min=1,
            max=10_000_000,
            help="How many crossings that the planner's screen judges feasible for unified, or else for the first"
            " controller. [default: 2000, or those of the study in --out]",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", min=0, help="Of all cases. [default: 1, or that of the study in --out]")
    ] = None,
    controllers: Annotated[str | None, controllers_option("those that the engine compiles, but path")] = None,
    rig: Annotated[
        str | None,
        typer.Option(
            "--rig",
            help="Whose robots to draw: {rigs}, or the path of a rig file; docs/sweeps.md says what each has and what"
            " it leaves out. Without a rig the robots differ in mass, inertia and friction by 15 %, and all else is"
            " exact but the encoders' rounding. [default: none, or that of the study in --out]",
        ),
    ] = None,
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            help="A shipped robot, or a robot file (.yaml): limits go with its torque and size. Robots are drawn as the"
            " file declares by tolerances, loads and transmission, else as without a rig."
            " [default: dextar, or that of the rig]",
        ),
    ] = None,
    changes: SetOption = None,
    quick: Annotated[bool, typer.Option("--quick", help=f"The same as --cases {QUICK_CASES}.")] = False,
    case: Annotated[
        int | None,
        typer.Option(
            "--case",
            min=0,
            help="Repeat only this case, and print its results. With --out, scenario and figure for every"
            " controller are written to that new directory.",
        ),
    ] = None,
    out: StudyOutOption = None,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    scheduler_file: SchedulerFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Count how many of thousands of random crossings succeed.

    The page shows success rates, errors and causes of failure of one or several controllers. An interrupted sweep
    resumes when it is given the same --out again.

    Example: `fivebar sweep --quick --out runs/sweep`

    Example: `fivebar sweep --rig middling --out runs/middling`

    Example: `fivebar sweep --rig calibrated --controllers unified --cases 5000 --out runs/calibrated`

    Example: `fivebar sweep --case 137 --controllers unified --out runs/case-137`
    """
    from fivebar_studies.rigs.declared import robots_drawn
    from fivebar_studies.rigs.named import named_rig

    with input_errors(), keyboard_interrupts():
        if quick and cases is not None:
            raise InputError("--quick: has its own number of cases: expected either --quick or --cases")
        if rig is not None and robot is not None:
            raise InputError("--robot: a rig has a robot of its own: expected either --rig or --robot")
        settings = {
            "seed": seed,
            "cases": QUICK_CASES if quick else cases,
            "rig": None if rig is None else named_rig("--rig", rig),
            "controllers": chosen_controllers(controllers),
            **({} if robot is None else robots_drawn(robot)),
        }
        if changes:
            settings["rig"] = _rig_with(changes, settings)
        if case is not None:
            _one_case(case, settings, out, as_json)
            return
        machines = Machines(jobs, scheduler, scheduler_file)
        finished = run_command("fivebar_studies.sweep.sweep:SWEEP", settings, out, machines, as_json)
    verdict = ("met", "green") if finished.content["met"] else ("not met", "red")
    columns = ("controller", "called feasible", "of them made", "share")
    show_study(finished, as_json, finished.shown, columns, [Text.assemble(verdict, f": {finished.content['verdict']}")])


def _rig_with(changes: list[str], arguments: Mapping[str, Any]) -> str:
    """Return the name of the rig of a sweep with changed keys of its scenarios.

    Raises:
        InputError: there is no rig, or a key is unknown, does not fit, or has no effect under any of the controllers.
    """
    from fivebar_bringup.scenarios.changes import (
        OF_STUDY,
        read_changes,
        refuse_changes_without_effect,
        refuse_decided,
    )
    from fivebar_studies.rigs.rig import SET
    from fivebar_studies.sweep.drawing import draw
    from fivebar_studies.sweep.sweep import SWEEP

    if not arguments.get("rig"):
        raise InputError(
            "--set: the robots of a sweep without a rig differ from case to case in what it draws: expected with --rig,"
            " such as --rig ideal, or with a --robot whose file has tolerances or loads"
        )
    keys = read_changes(changes)
    motion = ("waypoints", "trajectory", "working_mode", "segment_duration", "time_law", "blend_radius")
    drawn = {**dict.fromkeys(motion, DRAWN), "rate_hz": PLANNED_AT}
    refuse_decided(keys, {**OF_STUDY, **drawn})
    rig = SET.join((arguments["rig"], *changes))
    settings = SWEEP.settings_with({**arguments, "rig": rig})
    case = draw(settings.seed, 0, rig, settings.robot)
    try:
        scenarios = [case.scenario(name) for name in settings.controllers]
    except InputError as error:
        raise InputError(f"--set {str(error).removeprefix(f'case {case.number}: ')}") from error
    refuse_changes_without_effect(keys, scenarios)
    return rig


def _one_case(number: int, arguments: dict[str, Any], out: Path | None, as_json: bool) -> None:
    """Print a case, and write its scenarios and figures with --out.

    Raises:
        InputError: the directory cannot be used, or there is nothing to save.
    """
    from fivebar_bringup.recorded.results import finite
    from fivebar_studies.sweep.single import save_case
    from fivebar_studies.sweep.sweep import SWEEP

    rows = SWEEP.run(SWEEP.settings_with(arguments), number)
    written = [] if out is None else save_case(rows, out)
    if as_json:
        print(json.dumps(finite([row._asdict() for row in rows]), indent=2, allow_nan=False))
        return
    printer = Printer()
    for name, value in rows[0].draw._asdict().items():
        printer.print(f"{name}: {value}")
    if not rows[0].controller:
        printer.print(f"refused: {rows[0].reason}", soft_wrap=True)
        return
    table = Table(*SHOWN.values(), box=None)
    for row in rows:
        table.add_row(*(_short(getattr(row, name)) for name in SHOWN))
    printer.print(table)
    for row in rows:
        for reason in (row.why_not, row.reason):
            if reason:
                printer.print(f"{row.controller}: {reason}", soft_wrap=True)
    for path in written:
        printer.print(f"wrote {path}", soft_wrap=True)


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
