# SPDX-License-Identifier: Apache-2.0
"""A MOTKIN bench under its makers' stack, by their public facts: emulated by the clock, with its description."""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import yaml
from graph_probe import Bench
from std_msgs.msg import String

from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.hardware.motors_file import load_motors
from fivebar_description.interface import STATE_QOS, Topic

DESCRIPTION = Topic("/robot_description", "std_msgs/msg/String", STATE_QOS)
SHIPPED = "motkin_ros2_control"

REAL = "motkin_dual_motor_testbed_hardware/FiveBarSystem"
GAZEBO = "motkin_gz_ros2_control/GazeboMotkinSimSystem"


def joint(name: str, parent: str, child: str, xyz: str, axis: str, turn: float = 0.0, kind: str = "continuous") -> str:
    return (
        f'<link name="{child}"/><joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{xyz}" rpy="0 0 {turn}"/><axis xyz="{axis}"/></joint>'
    )


def description(crank: float = 0.06, axis: str = "0 0 -1", plugin: str = REAL) -> str:
    """Return what the bench's stack describes, by its public facts: the motors turn clockwise, the elbows do not."""
    upwards = math.pi / 2.0
    parts = [
        '<link name="case"/>',
        joint("motor_1", "case", "rotor", "-0.0421006 0.0302628 0", axis, upwards),
        joint("motor_2", "case", "rotor_2", "0.0578994 0.0302628 0", axis, upwards),
        joint("passive_1", "rotor", "arm_l2", f"{crank} 0 0", "0 0 1", 0.212 - upwards),
        joint("passive_2", "rotor_2", "arm_r2", "0.06 0 0", "0 0 1", 2.511 - upwards),
        joint("tip_1", "arm_l2", "closing_tip_2", "0.1 0 0", "0 0 1", kind="fixed"),
        joint("tip_2", "arm_r2", "closing_tip_1", "0.1 0 0", "0 0 1", kind="fixed"),
        f'<ros2_control name="bench" type="system"><hardware><plugin>{plugin}</plugin></hardware></ros2_control>',
    ]
    return f'<robot name="bench">{"".join(parts)}</robot>'


@contextmanager
def described(bench: Bench, text: str) -> Iterator[None]:
    """Publish a description as robot_state_publisher does."""
    probe = bench.probe(name="robot_state_publisher")
    probe.publish(DESCRIPTION, String(data=text))
    yield
    probe.close()


def emulated(folder: Path, unit: str = "A") -> tuple[Path, Path]:
    """Write the files of a bench under its public names that runs by the clock: its emulation's, and the bridge's."""
    files = write_drive_files(load_scenario("motkin_middle"), folder, SHIPPED)
    names = load_motors(SHIPPED).model_dump(mode="json")["link"]
    for file in files:
        content = yaml.safe_load(file.read_text(encoding="utf-8"))
        public = {key: names[key] for key in ("controller", "states", "manager")} | {"commands": "", "unit": unit}
        more = {"description": names["description"]} if file == files.drives else {}
        content |= {"pace": "clock", "link": {**content["link"], **public, **more}}
        file.write_text(yaml.safe_dump(content), encoding="utf-8")
    return files.emulation, files.drives
