# SPDX-License-Identifier: Apache-2.0
"""The robot of a run as a URDF."""

from __future__ import annotations

from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.planning.motor_limits import motor_limits
from fivebar_description.imu import ImuSettings
from fivebar_description.modules import modules_unopened
from fivebar_description.robot_description import robot_description
from fivebar_description.robot_file import read_robot
from fivebar_description.scenario_file import DEFAULT_ROBOT


def described_robot(robot: str = "", scenario: str = "") -> str:
    """Return the URDF of a robot (name or path), by default that of the scenario; its IMU is mounted as there.

    Raises:
        InputError: there is no such robot or scenario, or its file is wrong.
    """
    with modules_unopened():
        loaded = load_scenario(scenario) if scenario else None
    chosen = robot or (loaded.robot if loaded else DEFAULT_ROBOT)
    file = read_robot(chosen)
    imu = loaded.imu if loaded else ImuSettings()
    return robot_description(file.five_bar(), file.name, imu, file.weighed(), motor_limits(file))
