# SPDX-License-Identifier: Apache-2.0
"""A controller manager with two joints that a thread of this process serves, as real DDS has it."""

from __future__ import annotations

import os
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import pytest
import yaml
from closed_posture import closed_posture
from served_board import wait_for

from fivebar_description.strict_yaml import validate
from fivebar_sim.motors.configuration import MotorsEmulationFile
from fivebar_sim.motors.emulation import MotorsEmulation
from fivebar_sim.ros.ros2_control import ERRORS, ControllerManager

RATE_HZ = 50
PERIOD_US = 1_000_000 // RATE_HZ

LINK = {
    "controller": "/cell/effort_controller",
    "joints": ["right", "left"],
    "states": "/cell/joint_states",
    "manager": "/cell/controller_manager",
}
MOTORS = {
    "q11": {"id": 1, "counts_per_revolution": 20000, "gear_ratio": 2.0, "sign": -1, "zero_rad": 0.3},
    "q21": {"id": 0, "counts_per_revolution": 40000},
}
"""As they are; the file of the bridge may be wrong."""


def drives_file(folder: Path, **changed: Any) -> Path:
    """The bridge's file, patient enough for a shared machine."""
    motors = {joint: {**facts, "torque_limit_nm": 5.0} for joint, facts in MOTORS.items()}
    content = {
        "name": "cell",
        "interface": "ros2_control",
        "period_us": PERIOD_US,
        "gather_deadline_us": 15_000,
        "missing_limit": 15,
        "watchdog_ms": 400,
        "set_up_timeout_ms": 10_000,
        "link": LINK,
        "motors": motors,
        **changed,
    }
    path = folder / f"drives{len(list(folder.glob('drives*.yaml')))}.yaml"
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


class ControlledRobot:
    """The robot, and what breaks it."""

    def __init__(self, period_us: int, motors: Any = None, pace: str = "clock", lag: float = 0.0, **link: Any) -> None:
        """Begin; `lag` is a time (s) by which a busy machine delays each update."""
        content = {
            "name": "test",
            "robot": "dextar",
            "initial_joints": closed_posture(),
            "pace": pace,
            "period_us": period_us,
            "motors": motors or MOTORS,
            "link": {**LINK, **link},
        }
        file = validate(content, MotorsEmulationFile, "test")
        self.emulation = MotorsEmulation(file, ControllerManager, ERRORS, holds=True)
        self._orders: list[str] = []
        self._lag = lag
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self.emulation.run, args=(self._ending, self._obey))
        self._thread.start()

    def _obey(self) -> None:
        time.sleep(self._lag)
        while self._orders:
            self.emulation.obey(self._orders[0])
            self._orders.pop(0)

    def order(self, line: str) -> None:
        self._orders.append(line)
        wait_for(lambda: not self._orders)

    @property
    def torques(self) -> tuple[float, float]:
        """The torques (Nm) at the shafts of q11 and q21."""
        first, second = self.emulation.motors.motors
        return first.torque, second.torque

    def wait_for_no_torque(self) -> None:
        wait_for(lambda: self.torques == (0.0, 0.0))

    def close(self) -> None:
        self._ending.set()
        self._thread.join()
        self.emulation.close()


@contextmanager
def controlled_robot(domain: int, period_us: int = PERIOD_US, **link: Any) -> Iterator[ControlledRobot]:
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("ROS_DOMAIN_ID", str(domain))
        assert os.environ["ROS_DOMAIN_ID"] == str(domain)
        robot = ControlledRobot(period_us, **link)
    try:
        yield robot
    finally:
        robot.close()
