# SPDX-License-Identifier: Apache-2.0
"""Starts a controller manager of ros2_control with a five-bar's broadcaster and effort controller, as an example.

ros2 launch fivebar_bringup ros2_control.launch.py model:=/path/to/robot.urdf
ros2 launch fivebar_bringup ros2_control.launch.py model:=/path/to/robot.urdf manager:=false use_sim_time:=true

The URDF, with its section <ros2_control>, is that of `fivebar model ROBOT --format urdf`. A simulation has a controller
manager of its own, in a plugin of Gazebo or in the node of MuJoCo: with manager:=false only the controllers are
started there. Then drive it, in another terminal:

fivebar run experiment.yaml --hardware external --drives joints.yaml
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument, OpaqueFunction
from launch.conditions import IfCondition
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from fivebar_bringup.ros.launch_arguments import switch
from fivebar_bringup.runs.launching import YES
from fivebar_description.files import share_file

CONTROLLERS = ("joint_state_broadcaster", "effort_controller")


def start_controllers(context):
    """Return controller manager and spawner of the controllers."""
    model = LaunchConfiguration("model").perform(context)
    controllers = LaunchConfiguration("controllers").perform(context)
    simulated = LaunchConfiguration("use_sim_time").perform(context) == YES
    time = {"use_sim_time": simulated}
    described = {"robot_description": Path(model).read_text(encoding="utf-8")}
    return [
        Node(
            package="robot_state_publisher",
            executable="robot_state_publisher",
            parameters=[described, time],
            # where the shipped parameters have the broadcaster publish
            remappings=[("joint_states", "joint_state_broadcaster/joint_states")],
        ),
        Node(
            package="controller_manager",
            executable="ros2_control_node",
            parameters=[controllers, time],
            condition=IfCondition(LaunchConfiguration("manager")),
        ),
        Node(package="controller_manager", executable="spawner", arguments=[*CONTROLLERS, "--param-file", controllers]),
    ]


def generate_launch_description():
    """Return the launch description."""
    shipped = str(share_file("fivebar_bringup", "config", "ros2_control", "controllers.yaml"))
    return LaunchDescription(
        [
            DeclareLaunchArgument("model", description="URDF of the robot, with its section <ros2_control>."),
            DeclareLaunchArgument("controllers", default_value=shipped, description="Parameters of the controllers."),
            switch("manager", "A controller manager is started; a simulation has one.", YES),
            switch("use_sim_time", "The time is that of a simulation."),
            OpaqueFunction(function=start_controllers),
        ]
    )
