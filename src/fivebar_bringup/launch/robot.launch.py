"""Starts an experiment under `ros2 launch`: estimator, controllers, bridge and recorder, on real or emulated drives.

ros2 launch fivebar_bringup robot.launch.py scenario:=middle_robot hardware:=emulated out:=runs/rehearsed
ros2 launch fivebar_bringup robot.launch.py scenario:=mine.yaml hardware:=socketcan drives:=/path/to/drives.yaml
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, EmitEvent, OpaqueFunction, RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch.events import Shutdown
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from fivebar_bringup.runs.graph import Mode, crossing_graph
from fivebar_bringup.runs.rehearsal import Rehearsal, refuse_unfit, write_drive_files
from fivebar_bringup.runs.run_directory import new_run_directory
from fivebar_bringup.scenario import load_scenario


def start_graph(context):
    """Return the nodes of the chosen scenario; where one of them ends, all do, and the drives stop by themselves."""
    scenario = load_scenario(LaunchConfiguration("scenario").perform(context))
    refuse_unfit(scenario)
    out = LaunchConfiguration("out").perform(context)
    run = new_run_directory(Path(out) if out else None, scenario)
    run.parameters.mkdir()
    if LaunchConfiguration("hardware").perform(context) == "emulated":
        rehearsal = Rehearsal(write_drive_files(scenario, run.path))
        nodes = crossing_graph(scenario, Mode.REALTIME, run.bag, rehearsal)
    else:
        drives = LaunchConfiguration("drives").perform(context)
        nodes = crossing_graph(scenario, Mode.REALTIME, run.bag, drives=drives)
    actions = []
    for node in nodes:
        parameters = run.parameters / f"{node.executable}.yaml"
        parameters.write_text(node.parameter_file(), encoding="utf-8")
        action = Node(
            package=node.package,
            executable=node.executable,
            name=node.executable,
            parameters=[str(parameters)],
            output="screen",
        )
        ended = EmitEvent(event=Shutdown(reason=f"{node.executable} has ended; now: fivebar report {run.path}"))
        actions += [action, RegisterEventHandler(OnProcessExit(target_action=action, on_exit=[ended]))]
    return actions


def generate_launch_description():
    """Return the launch description."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "scenario", default_value="middle_robot", description="Shipped scenario or a YAML file."
            ),
            DeclareLaunchArgument("hardware", default_value="emulated", choices=["emulated", "socketcan"]),
            DeclareLaunchArgument(
                "drives", default_value="dextar_socketcan", description="With socketcan: configuration of the drives."
            ),
            DeclareLaunchArgument("out", default_value="", description="New directory for the results."),
            OpaqueFunction(function=start_graph),
        ]
    )
