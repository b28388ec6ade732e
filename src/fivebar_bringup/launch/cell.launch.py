# SPDX-License-Identifier: Apache-2.0
"""Starts several robots in one cell, each in its namespace with plant or bridge, with one clock, bag and RViz for all.

ros2 launch fivebar_bringup cell.launch.py robots:=left=unified_middle,right=middle record:=runs/cell

Each robot is what control.launch.py starts in its namespace. In lockstep they share the simulated time on /clock: none
measures its next sample before all have answered theirs. In real time /clock is the system's time.
"""

from pathlib import Path
from tempfile import NamedTemporaryFile

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from fivebar_bringup.bag import RECORDER
from fivebar_bringup.drives.hardware import Hardware
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.ros.installed_packages import refuse_missing
from fivebar_bringup.ros.launch_arguments import switch
from fivebar_bringup.ros.launch_scope import namespace_within, parameters_for_all
from fivebar_bringup.ros.launched_nodes import launched_nodes
from fivebar_bringup.runs.launching import (
    NO,
    YES,
    ControlRequest,
    cell_clock,
    cell_rviz_configuration,
    described_processes,
    recorder_of_cell,
)
from fivebar_description.files import share_file
from fivebar_description.interface import BASE_FRAME

FRAME = "cell"


def start_cell(context):
    """Return the nodes of all robots, and what they share."""
    words = ("robots", "mode", "hardware", "record", "activate", "stay", "rviz", "spacing")
    robots, mode, hardware, record, activate, stay, rviz, spacing = (
        LaunchConfiguration(name).perform(context) for name in words
    )
    if rviz == YES:
        refuse_missing("rviz:=true", "robot_state_publisher", "rviz2", "tf2_ros")
    scenarios = read_robots(robots)
    actions, recorders = [], {}
    for robot, scenario in scenarios.items():
        request = ControlRequest(
            scenario,
            mode=mode,
            hardware=hardware,
            activate=activate == YES and hardware == Hardware.EMULATED,
            stay=stay == YES,
            record=str(Path(record, robot)) if record else "",
            cell=True,
            parameters=parameters_for_all(context),
        )
        processes = described_processes(request)
        recorders[robot] = next((process for process in processes if process.name == RECORDER), None)
        actions += launched_nodes([process for process in processes if process.name != RECORDER], robot, {}, False)
    lockstep = mode == Mode.LOCKSTEP and hardware == Hardware.SIMULATED
    shared = [cell_clock(list(scenarios), lockstep)]
    if record:
        bag = Path(record, "bag").absolute()
        shared.append(recorder_of_cell(recorders, bag))
        for robot in recorders:
            # so that `fivebar report` finds scenario and bag of each robot
            Path(record, robot, "bag").symlink_to(Path("..", bag.name))
    actions += launched_nodes(shared, "", {}, False)
    places = {robot: namespace_within(context, robot).strip("/") for robot in scenarios}
    return actions + (view_of(scenarios, places, float(spacing)) if rviz == YES else [])


def read_robots(text):
    """Return the scenario of each robot by its namespace."""
    pairs = [pair.partition("=")[::2] for pair in text.split(",") if pair]
    names = [name for name, _ in pairs]
    if (
        len(pairs) < 1
        or len(set(names)) < len(names)
        or not all(name.isidentifier() and value for name, value in pairs)
    ):
        raise RuntimeError(f"robots:={text}: expected different names with a scenario each, left=middle,right=middle")
    return dict(pairs)


def view_of(scenarios, namespaces, spacing):
    """Return the nodes that show all robots in one RViz, side by side."""
    view = share_file("fivebar_bringup", "launch", "view.launch.py")
    actions = []
    for number, (robot, scenario) in enumerate(scenarios.items()):
        arguments = {"scenario": scenario, "namespace": robot, "rviz": NO}
        actions.append(
            IncludeLaunchDescription(PythonLaunchDescriptionSource(str(view)), launch_arguments=arguments.items())
        )
        place = [
            "--x",
            str(number * spacing),
            "--frame-id",
            FRAME,
            "--child-frame-id",
            f"{namespaces[robot]}/{BASE_FRAME}",
        ]
        actions.append(
            Node(package="tf2_ros", executable="static_transform_publisher", arguments=place, output="screen")
        )
    with NamedTemporaryFile("w", prefix="fivebar_", suffix=".rviz", encoding="utf-8", delete=False) as configuration:
        configuration.write(cell_rviz_configuration(list(namespaces.values()), FRAME))
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", configuration.name],
        parameters=[{"use_sim_time": True}],
        output="screen",
    )
    return [*actions, rviz]


def generate_launch_description():
    """Return the launch description."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "robots",
                default_value="left=unified_middle,right=unified_middle",
                description="Namespace and scenario of each robot.",
            ),
            DeclareLaunchArgument("mode", default_value="lockstep", choices=[mode.value for mode in Mode]),
            DeclareLaunchArgument(
                "hardware",
                default_value=Hardware.SIMULATED.value,
                choices=[Hardware.SIMULATED.value, Hardware.EMULATED.value],
                description="The simulated robots, or a bridge with emulated drives for each.",
            ),
            switch("activate", "The bridges enable their drives.", YES),
            switch("stay", "The robots take requests."),
            DeclareLaunchArgument("record", default_value="", description="New directory for one bag of all robots."),
            switch("rviz", "Show all in one RViz."),
            DeclareLaunchArgument("spacing", default_value="1.0", description="From one robot to the next there (m)."),
            OpaqueFunction(function=start_cell),
        ]
    )
