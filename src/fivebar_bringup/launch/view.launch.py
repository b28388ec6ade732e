# SPDX-License-Identifier: Apache-2.0
"""Shows a robot in RViz: robot_state_publisher with the URDF of the robot file, and RViz with its configuration.

ros2 launch fivebar_bringup view.launch.py robot:=dextar
ros2 launch fivebar_bringup view.launch.py scenario:=gyro_middle namespace:=robot1 use_sim_time:=true rviz:=false

The posture comes from `joint_states`: start a run beside it, or play its bag.
"""

from tempfile import NamedTemporaryFile

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

from fivebar_bringup.ros.installed_packages import refuse_missing
from fivebar_bringup.ros.launch_arguments import switch
from fivebar_bringup.ros.launch_scope import namespace_within
from fivebar_bringup.runs.launching import YES, described_by_command, rviz_configuration
from fivebar_description.interface import frame_prefix


def start_view(context):
    """Return the nodes that show the robot."""
    robot, scenario, namespace = (
        LaunchConfiguration(name).perform(context) for name in ("robot", "scenario", "namespace")
    )
    shown = ["rviz2"] if LaunchConfiguration("rviz").perform(context) == YES else []
    refuse_missing("view.launch.py", "robot_state_publisher", *shown)
    within = namespace_within(context, namespace)
    clock = {"use_sim_time": ParameterValue(LaunchConfiguration("use_sim_time"), value_type=bool)}
    # the simulated time of a robot in a namespace is its own
    remappings = [("/clock", f"/{frame_prefix(within)}clock")]
    publisher = Node(
        package="robot_state_publisher",
        executable="robot_state_publisher",
        namespace=namespace,
        parameters=[
            {
                # as it is: a parameter that looks like YAML would be read as such
                "robot_description": ParameterValue(described_by_command(robot, scenario), value_type=str),
                "frame_prefix": frame_prefix(within),
            },
            clock,
        ],
        remappings=remappings,
        output="screen",
    )
    with NamedTemporaryFile("w", prefix="fivebar_", suffix=".rviz", encoding="utf-8", delete=False) as configuration:
        configuration.write(rviz_configuration(within))
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        namespace=namespace,
        arguments=["-d", configuration.name],
        parameters=[clock],
        remappings=remappings,
        condition=IfCondition(LaunchConfiguration("rviz")),
        output="screen",
    )
    return [publisher, rviz]


def generate_launch_description():
    """Return the launch description."""
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "robot", default_value="", description="Shipped robot or a robot file; default: the scenario's."
            ),
            DeclareLaunchArgument(
                "scenario", default_value="", description="Take robot and mounting of the IMU from this scenario."
            ),
            DeclareLaunchArgument("namespace", default_value="", description="Namespace of the robot's nodes."),
            switch("use_sim_time", "Of all nodes."),
            switch("rviz", "Start RViz.", YES),
            OpaqueFunction(function=start_view),
        ]
    )
