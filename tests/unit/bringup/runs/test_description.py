# SPDX-License-Identifier: Apache-2.0
"""The robot that the launch file for RViz describes."""

from __future__ import annotations

import ast
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

from fivebar_bringup.runs.description import described_robot
from fivebar_bringup.runs.launching import described_by_command, installed_command, rviz_configuration
from fivebar_description.files import share_file
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import frame_prefix
from fivebar_description.robot_description import MotorLimits, robot_description
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import InputError


def test_a_robot_is_that_of_its_file_or_of_a_scenario(tmp_path: Path) -> None:
    scenario = tmp_path / "turned.yaml"
    content = {"name": "turned", "robot": "unequal", "waypoints": [[0.0, 0.1], [0.0, 0.12]], "imu": {"yaw": 0.5}}
    scenario.write_text(yaml.safe_dump(content), encoding="utf-8")

    def described(name: str, imu: ImuSettings | None = None) -> str:
        return robot_description(load_robot(name), name, imu, limits=MotorLimits(2.0, 50.0))

    assert described_robot() == described_robot("dextar") == described("dextar")
    turned = ImuSettings(yaw=0.5)
    assert described_robot(scenario=str(scenario)) == described("unequal", turned)
    assert described_robot("dextar", str(scenario)) == described("dextar", turned)
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


@pytest.mark.extra
def test_the_command_describes_the_robot_to_the_launch_file(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("AMENT_PREFIX_PATH", raising=False)
    assert described_by_command("unequal", "") == described_robot("unequal")
    with pytest.raises(RuntimeError, match="hexapod"):
        described_by_command("hexapod", "")


def test_an_installed_command_comes_before_the_module(tmp_path: Path) -> None:
    executable = tmp_path / "lib" / "fivebar_bringup" / "fivebar"
    environment = {"AMENT_PREFIX_PATH": f"/nowhere:{tmp_path}"}
    assert installed_command(environment)[0] == sys.executable
    executable.parent.mkdir(parents=True)
    executable.touch(mode=0o755)
    assert installed_command(environment) == (str(executable),)
    assert installed_command({})[0] == sys.executable


def test_launch_files_import_only_what_apt_has() -> None:
    """`ros2 launch` runs on the system's interpreter, outside of the environment that has pydantic and others."""
    lines = []
    paths = [
        *share_file("fivebar_bringup", "launch").glob("*.launch.py"),
        *share_file("fivebar_bringup", "fivebar_bringup", "ros").glob("launch*.py"),
    ]
    for path in sorted(paths):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            # what stands on ROS' launch, which may not be here, is read instead of imported
            module = str(node.module) if isinstance(node, ast.ImportFrom) else ""
            if module.startswith("fivebar") and not module.startswith("fivebar_bringup.ros."):
                lines.append(ast.unparse(node))
    assert any("described_by_command" in line for line in lines)
    block = (
        "import sys\nfor name in ('pydantic', 'typer', 'annotated_types', 'cv2', 'mcap'): sys.modules[name] = None\n"
    )
    done = subprocess.run([sys.executable, "-c", block + "\n".join(lines)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
