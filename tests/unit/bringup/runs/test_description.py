"""The robot that the launch file for RViz describes."""

from __future__ import annotations

import ast
from pathlib import Path

import pytest
import yaml

from fivebar_bringup.runs.description import described_robot, rviz_configuration
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import frame_prefix
from fivebar_description.robot_description import robot_description
from fivebar_description.robot_file import load_robot
from fivebar_description.share import share_file
from fivebar_description.strict_yaml import InputError


def test_a_robot_is_that_of_its_file_or_of_a_scenario(tmp_path: Path) -> None:
    scenario = tmp_path / "turned.yaml"
    content = {"name": "turned", "robot": "unequal", "waypoints": [[0.0, 0.1], [0.0, 0.12]], "imu": {"yaw": 0.5}}
    scenario.write_text(yaml.safe_dump(content), encoding="utf-8")
    assert described_robot() == described_robot("dextar") == robot_description(load_robot("dextar"), "dextar")
    turned = ImuSettings(yaw=0.5)
    assert described_robot(scenario=str(scenario)) == robot_description(load_robot("unequal"), "unequal", turned)
    assert described_robot("dextar", str(scenario)) == robot_description(load_robot("dextar"), "dextar", turned)
    with pytest.raises(InputError, match="hexapod"):
        described_robot("hexapod")


def test_frames_of_a_robot_carry_its_namespace() -> None:
    assert [frame_prefix(name) for name in ("", "/", "robot1", "/cell/left/")] == ["", "", "robot1/", "cell/left/"]


def test_rviz_shows_the_robot_of_the_namespace() -> None:
    for namespace, prefix, frame in (("", "", "base_link"), ("/robot1", "robot1", "robot1/base_link")):
        content = yaml.safe_load(rviz_configuration(namespace))["Visualization Manager"]
        (model,) = [one for one in content["Displays"] if one["Class"].endswith("RobotModel")]
        assert model["TF Prefix"] == prefix
        assert content["Global Options"]["Fixed Frame"] == frame


def test_the_launch_file_describes_the_robot_by_these() -> None:
    """It runs only where ROS' launch is (tests/launch)."""
    text = share_file("fivebar_bringup", "launch", "view.launch.py").read_text(encoding="utf-8")
    imported = {
        alias.name for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom) for alias in node.names
    }
    assert {"described_robot", "rviz_configuration", "frame_prefix"} <= imported
