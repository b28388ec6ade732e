# SPDX-License-Identifier: Apache-2.0
"""Starts the nodes of a scenario one by one, as a part of a larger system: the control chain, and what it is asked for.

ros2 launch fivebar_bringup control.launch.py scenario:=middle hardware:=simulated shutdown:=true
ros2 launch fivebar_bringup control.launch.py scenario:=mine.yaml hardware:=socketcan drives:=/path/to/drives.yaml

Which nodes these are follows from the scenario, as for `fivebar run`. Namespaces, parameters and remappings that are
set around this file (PushRosNamespace, SetParameter, SetRemap) are those of its nodes. These start in any order.
"""

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, IncludeLaunchDescription, OpaqueFunction
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration

from fivebar_bringup.drives.hardware import Hardware
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.ros.installed_packages import refuse_missing
from fivebar_bringup.ros.launch_arguments import switch
from fivebar_bringup.ros.launch_scope import parameters_for_all
from fivebar_bringup.ros.launched_nodes import launched_nodes
from fivebar_bringup.runs.launching import AS_IN_A_RUN, NO, NO_HARDWARE, YES, ControlRequest, described_processes
from fivebar_description.files import share_file

WORDS = ("scenario", "mode", "hardware", "drives", "port", "record", "imu", "camera", "composed")
SWITCHES = ("activate", "stay", "shutdown", "scene")


def start_nodes(context):
    """Return the nodes of the scenario, and the view of the robot where it is asked for."""
    words = {name: LaunchConfiguration(name).perform(context) for name in WORDS}
    switches = {name: LaunchConfiguration(name).perform(context) == YES for name in SWITCHES}
    namespace, clock, rviz = (
        LaunchConfiguration(name).perform(context) for name in ("namespace", "use_sim_time", "rviz")
    )
    if rviz == YES:
        refuse_missing("rviz:=true", "robot_state_publisher", "rviz2")
    request = ControlRequest(**words, **switches, parameters=parameters_for_all(context))
    own = {"use_sim_time": True} if clock == YES else {}
    actions = launched_nodes(described_processes(request), namespace, own, request.shutdown)
    if rviz == YES:
        view = share_file("fivebar_bringup", "launch", "view.launch.py")
        arguments = {"scenario": request.scenario, "namespace": namespace, "use_sim_time": clock}
        actions.append(
            IncludeLaunchDescription(PythonLaunchDescriptionSource(str(view)), launch_arguments=arguments.items())
        )
    return actions


def generate_launch_description():
    """Return the launch description."""
    choice = [AS_IN_A_RUN, YES, NO]
    hardware = [NO_HARDWARE, *(kind.value for kind in Hardware)]
    return LaunchDescription(
        [
            DeclareLaunchArgument("scenario", default_value="middle", description="Shipped scenario or a YAML file."),
            DeclareLaunchArgument("namespace", default_value="", description="Of all nodes, within pushed ones."),
            DeclareLaunchArgument("mode", default_value="lockstep", choices=[mode.value for mode in Mode]),
            DeclareLaunchArgument(
                "hardware",
                default_value=NO_HARDWARE,
                choices=hardware,
                description="Plant or bridge that is started besides; none: the states come from elsewhere.",
            ),
            DeclareLaunchArgument("drives", default_value="", description="Of a bridge: its configuration."),
            DeclareLaunchArgument("port", default_value="", description="With hardware:=usb: such as /dev/ttyACM0."),
            switch("activate", "The bridge enables the drives once all nodes are ready; else whoever activates it."),
            switch("stay", "A simulated robot takes requests afterwards."),
            switch("shutdown", "The launch ends with the plant, after the motion."),
            DeclareLaunchArgument("record", default_value="", description="New directory of a run, for its bag."),
            DeclareLaunchArgument("imu", default_value=AS_IN_A_RUN, choices=choice, description="The IMU listener."),
            DeclareLaunchArgument(
                "camera", default_value=AS_IN_A_RUN, choices=choice, description="The scenario's camera and listener."
            ),
            DeclareLaunchArgument(
                "composed",
                default_value=AS_IN_A_RUN,
                choices=choice,
                description="The control chain in one process: by default in real time.",
            ),
            switch("scene", "Pictures for RViz and Foxglove."),
            switch("rviz", "Start view.launch.py too."),
            switch("use_sim_time", "Of all nodes."),
            OpaqueFunction(function=start_nodes),
        ]
    )
