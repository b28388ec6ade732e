"""Starts the node graph of a scenario under `ros2 launch`, and ends with the run.

ros2 launch fivebar_bringup crossing.launch.py scenario:=middle mode:=lockstep out:=runs/from_launch
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from fivebar_bringup.runs.graph import PLANT, Mode, crossing_graph
from fivebar_bringup.runs.run_directory import new_run_directory
from fivebar_bringup.scenario import load_scenario


def start_graph(context):
    """Return the nodes of the chosen scenario, and what ends the launch when the plant has ended the run."""
    scenario = load_scenario(LaunchConfiguration("scenario").perform(context))
    mode = Mode(LaunchConfiguration("mode").perform(context))
    out = LaunchConfiguration("out").perform(context)
    run = new_run_directory(Path(out) if out else None, scenario)
    run.parameters.mkdir()
    actions = []
    for node in crossing_graph(scenario, mode, run.bag):
        parameters = run.parameters / f"{node.executable}.yaml"
        parameters.write_text(node.parameter_file(), encoding="utf-8")
        action = Node(
            package=node.package,
            executable=node.executable,
            name=node.executable,
            parameters=[str(parameters)],
            output="screen",
        )
        actions.append(action)
        if node.executable == PLANT:
            ended = EmitEvent(event=Shutdown(reason=f"the run has ended; now: fivebar report {run.path}"))
            actions.append(RegisterEventHandler(OnProcessExit(target_action=action, on_exit=[ended])))
    return actions


def generate_launch_description():
    """Return the launch description."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("scenario", default_value="middle", description="Shipped scenario or a YAML file."),
            DeclareLaunchArgument("mode", default_value="lockstep", choices=[mode.value for mode in Mode]),
            DeclareLaunchArgument("out", default_value="", description="New directory for the results."),
            OpaqueFunction(function=start_graph),
        ]
    )
