# SPDX-License-Identifier: Apache-2.0
"""A robot as a model for tools of others: MJCF or SDF with the closed loop, or URDF with ros2_control."""

from __future__ import annotations

import math

from fivebar_bringup.motions.model_format import ModelFormat
from fivebar_bringup.motions.start import HOME_MODE
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.state import JointAngles, WorkingMode
from fivebar_control.planning.motor_limits import motor_limits
from fivebar_description.errors import InputError
from fivebar_description.imu import ImuSettings
from fivebar_description.modules import modules_unopened
from fivebar_description.optional import MUJOCO_MODEL, optional_part
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_description import robot_tree, xml_text
from fivebar_description.robot_file import read_robot
from fivebar_description.ros2_control import MOCK, add_ros2_control
from fivebar_description.scenario_file import DEFAULT_ROBOT
from fivebar_description.sdf import sdf_text


def model_text(kind: ModelFormat, robot: str = "", scenario: str = "", plugin: str = "") -> str:
    """Return a robot as a model that begins in a posture with the loop closed: where a scenario starts, else at home.

    Args:
        kind: format of the model.
        robot: name or path, by default that of the scenario.
        scenario: name or path of what has the start and the mounting of the IMU.
        plugin: hardware component of ros2_control in a URDF, by default one that moves nothing.

    Raises:
        InputError: there is no such robot or scenario, its file is wrong, or the start is out of reach.
    """
    if plugin and kind is not ModelFormat.URDF:
        raise InputError(f"--plugin: {plugin}: expected with --format urdf only")
    with modules_unopened():
        loaded = load_scenario(scenario) if scenario else None
    chosen = robot or (loaded.robot if loaded else DEFAULT_ROBOT)
    file = read_robot(chosen)
    five_bar, imu = file.five_bar(), loaded.imu if loaded else ImuSettings()
    if loaded is not None:
        joints = _posture(five_bar, loaded.working_mode, loaded.waypoints[0], f"{scenario}: waypoints[0]")
    else:
        joints = _posture(five_bar, HOME_MODE, file.home_m, f"{chosen}: home_m")
    limits = motor_limits(file)
    torque_limit = limits.torque
    tree = robot_tree(five_bar, file.name, imu, file.weighed(), limits)
    if kind is ModelFormat.SDF:
        return sdf_text(tree, joints)
    if kind is ModelFormat.URDF:
        add_ros2_control(tree, plugin or MOCK, joints, torque_limit)
        return xml_text(tree)
    text: str = optional_part(MUJOCO_MODEL, f"--format {kind}")(five_bar, tree, joints, imu, torque_limit)
    return text


def _posture(robot: FiveBar, mode: WorkingMode, place: tuple[float, float], name: str) -> JointAngles:
    joints = inverse_geometry(robot, mode, *place)
    if not all(map(math.isfinite, joints)):
        raise InputError(f"{name}: ({place[0]:.4f}, {place[1]:.4f}) m: expected a place that both legs reach")
    return joints
