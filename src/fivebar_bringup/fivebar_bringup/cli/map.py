# SPDX-License-Identifier: Apache-2.0
"""Subcommand: map."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from fivebar_bringup.cli.app import Group, JsonOption, RobotArgument, RobotOption, command, input_errors, robot_of
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_description.interrupts import keyboard_interrupts


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
    from fivebar_bringup.map.map import make_map, read_mappable_robot
    from fivebar_bringup.pages.study_directory import StudyDirectory
    from fivebar_bringup.recorded.results import new_directory
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
