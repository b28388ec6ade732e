"""Subcommand that describes a robot to tools of ROS."""

from __future__ import annotations

from typing import Annotated

import typer

from fivebar_bringup.cli.app import Group, command, input_errors


@command(Group.FILES)
def urdf(
    robot: Annotated[str, typer.Argument(metavar="[ROBOT]", help="A shipped robot, or a robot file.")] = "",
    scenario: Annotated[
        str, typer.Option("--scenario", help="Take the robot, unless given, and the mounting of its IMU from this.")
    ] = "",
) -> None:
    """Print a robot as a URDF, for RViz and other tools.

    It has shapes, masses and the frames of the sensors.

    Example: `fivebar urdf dextar > dextar.urdf`

    Example: `fivebar urdf --scenario gyro_middle`
    """
    from fivebar_bringup.runs.description import described_robot

    with input_errors():
        print(described_robot(robot, scenario), end="")
