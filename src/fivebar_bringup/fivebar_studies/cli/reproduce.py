# SPDX-License-Identifier: Apache-2.0
"""Subcommand: reproduce."""

from __future__ import annotations

import json
from typing import Annotated

import typer
from rich.table import Table

from fivebar_bringup.cli.app import Group, JobsOption, JsonOption, command, input_errors
from fivebar_bringup.cli.printing import Printer
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts
from fivebar_studies.cli.study_options import (
    Machines,
    SchedulerFileOption,
    SchedulerOption,
    StudyOutOption,
    run_command,
)

THESIS_ROBOT = "dextar"


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
    place = "fivebar_studies.reproduce.reproduce:REPRODUCTION"
    with input_errors(), keyboard_interrupts():
        if robot != THESIS_ROBOT:
            raise InputError(
                f"--robot: {robot!r}: expected {THESIS_ROBOT}, with which the thesis' figures were made: fivebar"
                " assess, compare, sweep, benchmark and robustness take any robot"
            )
        finished = run_command(place, {"quick": quick or None}, out, Machines(jobs, scheduler, scheduler_file), as_json)
    if as_json:
        print(json.dumps(finished.content, indent=2, allow_nan=False))
        return
    table = Table("thesis", "about", "verdict", box=None)
    for row in finished.shown:
        table.add_row(row.place, row.title, str(row.judgement.verdict))
    Printer().print(table)
    Printer().print(f"look at {finished.page}", soft_wrap=True)
