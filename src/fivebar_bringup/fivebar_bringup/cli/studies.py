"""Subcommands that map a robot or reproduce the thesis: map, reproduce."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from fivebar_bringup.cli.app import (
    Group,
    JobsOption,
    JsonOption,
    RobotArgument,
    RobotOption,
    command,
    input_errors,
    robot_of,
)
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_bringup.cli.study_options import (
    Machines,
    SchedulerFileOption,
    SchedulerOption,
    StudyOutOption,
    run_command,
)
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts

THESIS_ROBOT = "dextar"


@command(Group.ROBOT, "map")
def map_robot(
    robot: RobotArgument = "",
    robot_option: RobotOption = "",
    out: Annotated[
        Path | None,
        typer.Option("--out", help="New or empty directory for the results [default: runs/map-ROBOT-DATE-TIME]"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Draw where a robot reaches and where it is singular.

    The page shows the workspace and the loci over the platform's plane and over the motor angles.

    Example: `fivebar map dextar --out runs/map`
    """
    from fivebar_bringup.recorded.results import new_directory
    from fivebar_bringup.studies.map.map import make_map, read_mappable_robot
    from fivebar_bringup.studies.study_directory import StudyDirectory
    from fivebar_description.scenario_file import DEFAULT_ROBOT

    with input_errors(), keyboard_interrupts():
        file = read_mappable_robot(robot_of(robot, robot_option) or DEFAULT_ROBOT)
        directory = StudyDirectory(new_directory(out, f"map-{file.name}"), "map")
        with progress_bar(f"map of {file.name}", as_json) as progress:
            measures = make_map(file, directory, progress)
    if as_json:
        print(json.dumps(measures, indent=2, allow_nan=False))
    else:
        Printer().print(f"look at {directory.page}", soft_wrap=True)


@command(Group.STUDY)
def reproduce(
    quick: Annotated[bool, typer.Option("--quick", help="One duration and one perturbed plant only.")] = False,
    robot: Annotated[
        str, typer.Option("--robot", metavar="ROBOT", help="Only that of the thesis, which the claims are about.")
    ] = THESIS_ROBOT,
    out: StudyOutOption = None,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    scheduler_file: SchedulerFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Compute the figures of the thesis and judge its claims.

    It runs without ROS. Each row is judged by the measured values.

    Example: `fivebar reproduce --out runs/thesis`
    """
    place = "fivebar_bringup.studies.reproduce.reproduce:REPRODUCTION"
    with input_errors(), keyboard_interrupts():
        if robot != THESIS_ROBOT:
            raise InputError(
                f"--robot: {robot!r}: expected {THESIS_ROBOT}, with which the thesis' figures were made: fivebar"
                " assess, compare, sweep, benchmark and robustness take any robot"
            )
        made = run_command(place, {"quick": quick or None}, out, Machines(jobs, scheduler, scheduler_file), as_json)
    if as_json:
        print(json.dumps(made.content, indent=2, allow_nan=False))
        return
    table = Table("thesis", "about", "verdict", box=None)
    for row in made.shown:
        table.add_row(row.place, row.title, str(row.judgement.verdict))
    Printer().print(table)
    Printer().print(f"look at {made.page}", soft_wrap=True)
