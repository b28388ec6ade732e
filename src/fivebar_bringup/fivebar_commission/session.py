# SPDX-License-Identifier: Apache-2.0
"""A commissioning under way: its files, the robot, the person, and what has been learnt so far."""

from __future__ import annotations

import itertools
from collections.abc import Callable
from contextlib import AbstractContextManager, nullcontext
from pathlib import Path
from typing import Any

from fivebar_bringup.motions.start import HOME_MODE
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.scenario import Scenario
from fivebar_commission.bench import RobotBench
from fivebar_commission.drives_file import DrivesFile
from fivebar_commission.limits import Allowed, AllowedDrives
from fivebar_commission.person import Person, PutAt
from fivebar_commission.record import CommissionState
from fivebar_commission.step import GateClosed
from fivebar_control.hardware.drive_interface import DriveReading
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.state import JointAngles
from fivebar_control.scenario.robot_defaults import derived_tuning
from fivebar_description.files import write_file
from fivebar_description.imu import ImuSettings
from fivebar_description.interface import ACTIVE_JOINTS
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.strict_yaml import validate, yaml_text
from fivebar_studies.engine.running import Progress, silent

ROBOT_FILE, DRIVES_FILE = "robot.yaml", "drives.yaml"

TOLERATED = {"length": 3e-4, "base": 3e-4, "zero": 6e-3}
"""Tolerances (m, rad) of a robot whose file declares none: put together by hand, its zeros set at a mark."""

READINGS = 20
"""Cycles whose mean is a reading of a robot at rest."""

AWAY = 0.015
"""Angle (rad) of a motor from its start beyond which the robot has to be put there by hand: an estimator takes 0.02."""


class Session:
    """The state that the steps share."""

    def __init__(
        self, folder: Path, state: CommissionState, bench: RobotBench, person: Person, tell: Callable[[str], None]
    ) -> None:
        """Go on from a state in a folder, which has the files of robot and drives.

        `shown` shows the progress of long work, by its name.
        """
        self.folder, self.state, self.bench, self.person, self.tell = folder, state, bench, person, tell
        self.allowed = Allowed(state.torque_nm, state.speed_rad_s)
        self.shown: Callable[[str], AbstractContextManager[Progress]] = lambda name: nullcontext(silent)

    def close(self) -> None:
        """Leave the robot."""
        self.bench.close()

    @property
    def robot_path(self) -> Path:
        """The robot file, as far as the robot is known."""
        return (self.folder / ROBOT_FILE).absolute()

    @property
    def drives_path(self) -> Path:
        """The configuration of the drives, as far as they are known."""
        return (self.folder / DRIVES_FILE).absolute()

    @property
    def robot(self) -> RobotFile:
        """The robot, as far as it is known."""
        return read_robot(str(self.robot_path))

    @property
    def five_bar(self) -> FiveBar:
        """The same as numbers."""
        return self.robot.five_bar()

    def learn_robot(self, file: RobotFile) -> None:
        """Write the robot file again, under the robot's own name."""
        named = file.model_copy(update={"name": self.robot.name if self.robot_path.exists() else file.name})
        write_file(self.robot_path, yaml_text(named.model_dump(mode="json", exclude_none=True)))

    @property
    def drives(self) -> DrivesFile:
        """The drives, as far as they are known."""
        return DrivesFile(self.drives_path)

    def learn(self, **update: Any) -> None:
        """Keep something else that has been learnt, once the step has been passed."""
        self.state = self.state.model_copy(update=update)

    @property
    def imu(self) -> ImuSettings | None:
        """The gyroscope, as far as it is known."""
        return None if self.state.imu is None else ImuSettings(**self.state.imu)

    def new_folder(self, name: str) -> Path:
        """Return the path of a new folder for a run of a step."""
        return self._folders(name)[-1]

    def last_folder(self, name: str) -> Path | None:
        """Return the newest folder of that name; None where there is none."""
        return next(iter(self._folders(name)[-2:-1]), None)

    def _folders(self, name: str) -> list[Path]:
        """Return the folders of a name, and the path of a new one."""
        runs = self.folder / "runs"
        runs.mkdir(exist_ok=True)
        folders = list[Path]()
        for number in itertools.count(1):
            folders.append(runs / f"{name}_{number}")
            if not folders[-1].exists():
                break
        return folders

    def opened(self) -> AbstractContextManager[AllowedDrives]:
        """Open the drives for a block, without torque."""
        return self.bench.opened(self.drives_path, self.allowed)

    def reading(self, drives: AllowedDrives) -> tuple[float, float]:
        """Return the angles (rad) of both motors, which are at rest.

        Raises:
            GateClosed: a drive does not answer.
        """
        seen: list[tuple[DriveReading, DriveReading]] = []
        for _ in range(5 * READINGS):
            self.bench.wait()
            first, second = drives.exchange().readings
            if first is not None and second is not None:
                seen.append((first, second))
            if len(seen) == READINGS:
                break
        else:
            raise GateClosed("feedback_missing", f"{len(seen)} complete answers in {5 * READINGS} cycles")
        q11, q21 = (sum(pair[number].position for pair in seen) / READINGS for number in range(2))
        return q11, q21

    def angles_at(self, x: float, y: float) -> JointAngles:
        """Return the joint angles (rad) with the platform at a place (m), for the robot as far as it is known."""
        return inverse_geometry(self.five_bar, HOME_MODE, x, y)

    def at_home(self) -> None:
        """Bring the robot home, by hand where it is not there.

        Raises:
            GateClosed: it does not after that either.
        """
        home = self.robot.home_m
        expected = self.angles_at(*home)
        for attempt in range(2):
            with self.opened() as drives:
                q11, q21 = self.reading(drives)
            away = max(abs(q11 - expected.q11), abs(q21 - expected.q21))
            if away <= AWAY:
                return
            if attempt == 0:
                self.person.does(
                    "home",
                    f"Put the platform back at home, ({home[0]:g}, {home[1]:g}) m, elbows outwards",
                    PutAt(*home),
                )
        raise GateClosed("not_at_home", f"a motor is {away:.2f} rad from where it is with the platform at home")

    def run(self, scenario: Scenario, name: str, page: bool = False) -> tuple[RunDirectory, Summary]:
        """Run a scenario from home, in a new folder, which keeps the drives' file as it was.

        Raises:
            GateClosed: the robot is not at home, or a drive has a fault.
            KeyboardInterrupt: the run has been interrupted.
        """
        self.at_home()
        folder, summary = self.bench.run(scenario, self.drives_path, self.new_folder(name), page)
        if summary.outcome is RunOutcome.INTERRUPTED:
            raise KeyboardInterrupt
        self.keep_drives(folder)
        return folder, summary

    def keep_drives(self, folder: RunDirectory) -> None:
        """Keep the drives' file as it was while something was recorded."""
        self.drives.write(folder.path / DRIVES_FILE)

    def _declared_play(self) -> dict[str, float]:
        """Return by how much the estimator expects motors and links to differ, where the file says that they may."""
        tuning = derived_tuning(self.robot)
        return {"play": tuning["play"]} if "play" in tuning else {}

    def scenario(self, name: str, **content: Any) -> Scenario:
        """Return a scenario of the robot, within what it is allowed."""
        drives = self.drives
        counts = [round(drives.facts(joint).counts) for joint in ACTIVE_JOINTS]
        plant = {"torque_limit": self.allowed.torque, "encoder_counts": min(counts), "delay_samples": 1}
        safety = {"torque_limit": self.allowed.torque, "joint_speed_limit": self.allowed.speed}
        known: dict[str, Any] = {
            "name": name,
            "robot": str(self.robot_path),
            "controller": "unified",
            "working_mode": list(HOME_MODE),
            "rate_hz": drives.rate_hz,
            "estimator": "ekf",
            # what the robot file says of a sensor is a claim until it has been commissioned
            "ekf": {"gyro": False} | self._declared_play() | content.pop("ekf", {}),
            "plant": plant | content.pop("plant", {}),
            "safety": safety | content.pop("safety", {}),
        }
        if self.state.imu is not None:
            known["imu"] = self.state.imu
        return validate(known | content, Scenario, name)
