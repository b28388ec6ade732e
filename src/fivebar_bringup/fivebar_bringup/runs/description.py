"""The robot of a run as a URDF, for the command and the launch files."""

from __future__ import annotations

from fivebar_bringup.scenario import load_scenario
from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import read_robot
from fivebar_description.robot_description import robot_description

DEFAULT_ROBOT = "dextar"


def described_robot(robot: str = "", scenario: str = "") -> str:
    """Return the URDF of a robot (name or path), by default that of the scenario; its IMU is mounted as there.

    Raises:
        InputError: there is no such robot or scenario, or its file is wrong.
    """
    loaded = load_scenario(scenario) if scenario else None
    chosen = robot or (loaded.robot if loaded else DEFAULT_ROBOT)
    file = read_robot(chosen)
    return robot_description(file.five_bar(), file.name, loaded.imu if loaded else ImuSettings())


def frame_prefix(namespace: str) -> str:
    """Return what stands before the frames of a robot in a namespace, "robot1/"; "" without one."""
    name = namespace.strip("/")
    return f"{name}/" if name else ""
