# SPDX-License-Identifier: Apache-2.0
"""Runs a scenario under `ros2 launch` as `fivebar run` does, and shuts down when the run ends.

ros2 launch fivebar_bringup crossing.launch.py scenario:=middle mode:=lockstep out:=runs/from_launch

The last lines of output name the directory of bag, report and summary. The launch fails if the run did not succeed.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.substitutions import LaunchConfiguration

from fivebar_bringup.drives.hardware import Hardware
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.ros.launch_arguments import switch
from fivebar_bringup.ros.launch_scope import refuse_what_is_set
from fivebar_bringup.ros.launched_run import launched_run
from fivebar_bringup.runs.launching import YES, run_command


def start_run(context):
    """Return the process of the run, and what ties the launch to it."""
    refuse_what_is_set(context, "crossing.launch.py")
    scenario, mode, out = (LaunchConfiguration(name).perform(context) for name in ("scenario", "mode", "out"))
    namespace = LaunchConfiguration("namespace").perform(context)
    scene = LaunchConfiguration("scene").perform(context) == YES
    command = run_command(scenario, Mode(mode), out, Hardware.SIMULATED, scene=scene, namespace=namespace)
    return launched_run(command)


def generate_launch_description():
    """Return the launch description."""
    return LaunchDescription(
        [
            DeclareLaunchArgument("scenario", default_value="middle", description="Shipped scenario or a YAML file."),
            DeclareLaunchArgument("mode", default_value="lockstep", choices=[mode.value for mode in Mode]),
            DeclareLaunchArgument("out", default_value="", description="New directory for the results."),
            switch("scene", "Pictures for RViz and Foxglove."),
            DeclareLaunchArgument("namespace", default_value="", description="Of all nodes, such as robot1."),
            OpaqueFunction(function=start_run),
        ]
    )
