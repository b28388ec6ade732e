# SPDX-License-Identifier: Apache-2.0
"""Subcommands that describe a robot to ROS and to simulators: urdf, model."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fivebar_bringup.cli.app import Group, RobotArgument, RobotOption, command, input_errors, robot_of
from fivebar_bringup.motions.model_format import ModelFormat

ScenarioOption = Annotated[
    str,
    typer.Option("--scenario", help="Take the robot, unless given, its start and the mounting of its IMU from this."),
]


@command(Group.FILES)
def urdf(robot: RobotArgument = "", robot_option: RobotOption = "", scenario: ScenarioOption = "") -> None:
    """Print a robot as a URDF, for RViz and other tools.

    It has shapes, masses and the frames of the sensors.

    Example: `fivebar urdf dextar > dextar.urdf`

    Example: `fivebar urdf --scenario gyro_middle`
    """
    from fivebar_bringup.runs.description import described_robot

    with input_errors():
        print(described_robot(robot_of(robot, robot_option), scenario), end="")


@command(Group.FILES)
def model(
    robot: RobotArgument = "",
    robot_option: RobotOption = "",
    scenario: ScenarioOption = "",
    kind: Annotated[
        ModelFormat,
        typer.Option("--format", help="MuJoCo and Gazebo close the loop; the URDF is a tree with ros2_control."),
    ] = ModelFormat.MJCF,
    plugin: Annotated[
        str, typer.Option("--plugin", help="Of the URDF: the hardware component [default: {mock_component}]")
    ] = "",
    out: Annotated[Path | None, typer.Option("--out", help="File to write [default: standard output]")] = None,
) -> None:
    """Write a robot as a model for simulators and ros2_control.

    MJCF and SDF have the closed loop, and begin in a posture where it is closed.

    Example: `fivebar model --robot dextar --format mjcf --out dextar.xml`

    Example: `fivebar model --format urdf --plugin gz_ros2_control/GazeboSimSystem`
    """
    from fivebar_bringup.motions.model_file import model_text
    from fivebar_description.files import write_file

    with input_errors():
        text = model_text(kind, robot_of(robot, robot_option), scenario, plugin)
        if out is None:
            print(text, end="")
        else:
            write_file(out, text)
