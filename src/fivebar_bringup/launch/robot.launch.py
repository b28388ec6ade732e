# SPDX-License-Identifier: Apache-2.0
"""Runs an experiment under `ros2 launch`: estimator, controllers, bridge and recorder, with real or emulated drives.

ros2 launch fivebar_bringup robot.launch.py scenario:=middle_robot hardware:=emulated out:=runs/rehearsed
ros2 launch fivebar_bringup robot.launch.py scenario:=mine.yaml hardware:=socketcan drives:=/path/to/drives.yaml
ros2 launch fivebar_bringup robot.launch.py scenario:=motkin_middle hardware:=usb port:=/dev/ttyACM0

This is the run of `fivebar run SCENARIO --hardware ...`: it shuts down when the run ends, and fails if it did not
succeed. Emulated drives and a motor board are powered as soon as all nodes are ready; real drives on a bus once the
operator has configured and activated the bridge, or by themselves with activate:=true.
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


def start_experiment(context):
    """Return the process of the run, and what ties the launch to it."""
    refuse_what_is_set(context, "robot.launch.py")
    names = ("scenario", "hardware", "drives", "port", "out", "namespace")
    scenario, hardware, drives, port, out, namespace = (LaunchConfiguration(name).perform(context) for name in names)
    activate, scene = (LaunchConfiguration(name).perform(context) == YES for name in ("activate", "scene"))
    command = run_command(
        *(scenario, Mode.REALTIME, out, Hardware(hardware)),
        scene=scene,
        namespace=namespace,
        drives=drives,
        port=port,
        activate=activate,
    )
    return launched_run(command)


def generate_launch_description():
    """Return the launch description."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "scenario", default_value="middle_robot", description="Shipped scenario or a YAML file."
            ),
            DeclareLaunchArgument(
                "hardware",
                default_value=Hardware.EMULATED.value,
                choices=[kind.value for kind in Hardware if kind != Hardware.SIMULATED],
            ),
            DeclareLaunchArgument(
                "drives",
                default_value="",
                description="With socketcan: configuration of the drives; with usb: that of the board.",
            ),
            switch(
                "activate",
                "With socketcan: enable the drives as soon as all nodes are ready, without the operator.",
            ),
            DeclareLaunchArgument("port", default_value="", description="With usb: such as /dev/ttyACM0."),
            DeclareLaunchArgument("out", default_value="", description="New directory for the results."),
            switch("scene", "Pictures for RViz and Foxglove."),
            DeclareLaunchArgument("namespace", default_value="", description="Of all nodes, such as robot1."),
            OpaqueFunction(function=start_experiment),
        ]
    )
