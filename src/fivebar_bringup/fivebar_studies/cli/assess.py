# SPDX-License-Identifier: Apache-2.0
"""Subcommand that says what a robot can do: assess."""

from __future__ import annotations

import json
from typing import Annotated, Any

import typer

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
)


@command(Group.ROBOT)
def assess(
    robot: RobotArgument = "",
    robot_option: RobotOption = "",
    controllers: Annotated[str | None, controllers_option("unified")] = None,
    cases: Annotated[
        int | None,
        typer.Option(
            "--cases",
            min=2,
            max=100_000,
            help="How many random crossings within reach to run. [default: 60, or those of the study in --out]",
        ),
    ] = None,
    seed: Annotated[
        int | None, typer.Option("--seed", min=0, help="Of all draws. [default: 1, or that of the study in --out]")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="10 crossings on fewer robots: about a minute.")] = False,
    out: StudyOutOption = None,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    scheduler_file: SchedulerFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Tell what a robot can do, and what to calibrate first.

    From a robot file, with what it declares: where the robot goes and crosses, how exactly, what each error that is
    removed brings, with which sensors, and the tuning that its transmissions allow. What the file leaves open is
    assumed, and said.

    Example: `fivebar assess my_robot.yaml --out runs/my_robot`

    Example: `fivebar assess my_robot.yaml --quick --controllers unified,multi_cartesian`
    """
    from fivebar_bringup.map.map import read_mappable_robot
    from fivebar_description.scenario_file import DEFAULT_ROBOT
    from fivebar_studies.assess.assess import ASSESSMENT, QUICK
    from fivebar_studies.rigs.declared import robot_name
    from fivebar_studies.rigs.named import find_rig
    from fivebar_studies.rigs.rig import OF_ROBOT

    with input_errors(), keyboard_interrupts():
        if quick and cases is not None:
            raise InputError("--quick: has its own number of cases: expected either --quick or --cases")
        asked = robot_of(robot, robot_option)
        name = robot_name(asked or DEFAULT_ROBOT)
        read_mappable_robot(name)
        find_rig(f"{OF_ROBOT}{name}")
        settings: dict[str, Any] = {
            "robot": name if asked else None,
            "cases": cases,
            "seed": seed,
            "controllers": chosen_controllers(controllers),
            **(QUICK if quick else {}),
        }
        finished = run_command(ASSESSMENT.place, settings, out, Machines(jobs, scheduler, scheduler_file), as_json)
    if as_json:
        print(json.dumps(finished.content, indent=2, allow_nan=False))
        return
    printer = Printer(soft_wrap=True)
    printer.print("\n".join((*finished.shown, f"look at {finished.page}")), highlight=False)
