"""The robot of a run as a URDF, for the command and the launch files."""

from __future__ import annotations

from fivebar_bringup.scenario_files import load_scenario
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import BASE_FRAME, frame_prefix
from fivebar_description.robot_description import robot_description
from fivebar_description.robot_file import read_robot
from fivebar_description.share import share_file

DEFAULT_ROBOT = "dextar"


def described_robot(robot: str = "", scenario: str = "") -> str:
    """Return the URDF of a robot (name or path), by default that of the scenario; its IMU is mounted as there.

    Raises:
        InputError: there is no such robot or scenario, or its file is wrong.
    """
    loaded = load_scenario(scenario) if scenario else None
    chosen = robot or (loaded.robot if loaded else DEFAULT_ROBOT)
    file = read_robot(chosen)
    return robot_description(file.five_bar(), file.name, loaded.imu if loaded else ImuSettings(), file.weighed())


def rviz_configuration(namespace: str) -> str:
    """Return the configuration of RViz for a robot in a namespace, "" for none."""
    text = share_file("fivebar_bringup", "rviz", "fivebar.rviz").read_text(encoding="utf-8")
    prefix = frame_prefix(namespace)
    # RViz puts the slash itself
    with_prefix = text.replace('TF Prefix: ""', f'TF Prefix: "{prefix.rstrip("/")}"')
    return with_prefix.replace(f"Fixed Frame: {BASE_FRAME}", f"Fixed Frame: {prefix}{BASE_FRAME}")
