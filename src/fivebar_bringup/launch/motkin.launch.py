# SPDX-License-Identifier: Apache-2.0
"""Crosses with the MOTKIN bench, or its Gazebo simulation, beside the launch file of its makers' ROS 2 stack.

ros2 launch fivebar_bringup motkin.launch.py
ros2 launch fivebar_bringup motkin.launch.py simulation:=true out:=runs/gazebo
ros2 launch fivebar_bringup motkin.launch.py robot:=/bench_2 scenario:=mine.yaml drives:=mine_drives.yaml

It waits for their controller manager and says for what it waits, compares geometry, zeros and the unit of efforts with
the robot that they describe, and rate, joints and posture with the run. Then it enables the motors. It shuts down with
the run, and fails if that did not succeed.
"""

from pathlib import Path
from tempfile import NamedTemporaryFile

import yaml
from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration

from fivebar_bringup.drives.hardware import Hardware
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.ros.launch_arguments import switch
from fivebar_bringup.ros.launch_scope import refuse_what_is_set
from fivebar_bringup.ros.launched_run import launched_run
from fivebar_bringup.runs.launching import YES, run_command
from fivebar_description.files import share_file

NAMES = ("controller", "states", "manager")
"""Full names in a drives file's section `link`, which are in the robot's namespace."""


def start_crossing(context):
    """Return the process of the run, and what ties the launch to it."""
    refuse_what_is_set(context, "motkin.launch.py")
    names = ("scenario", "drives", "controller", "robot", "simulation", "namespace", "out", "activate")
    arguments = {name: LaunchConfiguration(name).perform(context) for name in names}
    command = run_command(
        *(arguments["scenario"], Mode.REALTIME, arguments["out"], Hardware.EXTERNAL),
        namespace=arguments["namespace"],
        drives=drives_file(
            arguments["drives"], arguments["controller"], arguments["robot"], arguments["simulation"] == YES
        ),
        activate=arguments["activate"] == YES,
    )
    return launched_run(command)


def drives_file(drives, controller, robot, simulated):
    """Return the path of a copy of a drives file, with the names and the unit of this robot."""
    path = Path(drives)
    if not path.suffix:
        path = share_file("fivebar_control", "config", "motors", f"{drives}.yaml")
    content = yaml.safe_load(path.read_text(encoding="utf-8"))
    link = content["link"]
    if controller:
        link["controller"] = f"/{controller}"
    place = f"/{robot.strip('/')}" if robot.strip("/") else ""
    link.update({name: place + link[name] for name in NAMES})
    link["description"]["topic"] = place + link["description"]["topic"]
    if simulated:
        link["unit"] = "Nm"
    with NamedTemporaryFile("w", prefix="fivebar_", suffix=".yaml", encoding="utf-8", delete=False) as copy:
        yaml.safe_dump(content, copy)
    return copy.name


def generate_launch_description():
    """Return the launch description."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "scenario", default_value="motkin_middle", description="Shipped scenario or a YAML file."
            ),
            DeclareLaunchArgument(
                "drives", default_value="motkin_ros2_control", description="Shipped drives file, or the path of one."
            ),
            DeclareLaunchArgument(
                "controller", default_value="", description="Name of the controller, where it is not the file's."
            ),
            DeclareLaunchArgument("robot", default_value="", description="Namespace of their nodes, such as bench_2."),
            switch("simulation", "Their robot is simulated, and its efforts are torques."),
            switch(
                "activate", "The motors are enabled as soon as all nodes are ready; else whoever activates them.", YES
            ),
            DeclareLaunchArgument("namespace", default_value="fivebar", description="Of the nodes of this project."),
            DeclareLaunchArgument("out", default_value="", description="New directory for the results."),
            OpaqueFunction(function=start_crossing),
        ]
    )
