# SPDX-License-Identifier: Apache-2.0
"""The state of a commissioning, a file that people read and that `fivebar commission` resumes from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from fivebar_bringup.recorded.results import finite, write_results
from fivebar_description.imu import ImuSettings
from fivebar_description.strict_yaml import InputError, StrictModel, read_yaml, yaml_text

STATE_FILE = "commission.yaml"

Outcome = Literal["passed", "closed"]
PASSED: Outcome = "passed"
CLOSED: Outcome = "closed"

NonNegative = Annotated[float, Field(ge=0.0)]


def imu_keys(imu: ImuSettings) -> dict[str, Any]:
    """Return what is known of an IMU as keys of the section `imu`: those that differ from the defaults."""
    usual = ImuSettings()._asdict()
    return {key: value for key, value in imu._asdict().items() if value != usual[key]}


class StepRecord(StrictModel):
    """How a step has ended.

    Attributes:
        step: its name.
        outcome: whether its gate was passed or is closed.
        words: what was found, or why the gate is closed, beginning with the name of the reason.
        figures: what was measured.
        pages: further pages or folders.
        questions: how many there were.
        robot_s: time on the robot (s), simulated where the robot is.
        wall_s: time by the clock (s).
    """

    step: str
    outcome: Outcome
    words: str
    figures: dict[str, Any] = Field(default_factory=dict)
    pages: Annotated[tuple[str, ...], Field(strict=False)] = ()
    questions: Annotated[int, Field(ge=0)] = 0
    robot_s: NonNegative = 0.0
    wall_s: NonNegative = 0.0


class CommissionState(StrictModel):
    """The whole state.

    Attributes:
        robot: the robot file that it began with.
        drives: the configuration of the drives that it began with; empty for a simulated robot.
        practice: the simulated robot, by its number or file; empty for a real one.
        realtime: whether the simulated robot moves by the clock.
        torque_nm, speed_rad_s: what the robot is allowed.
        imu: mounting and rates of the IMU as far as they are known, as in a scenario.
        transmissions: what was found of the transmissions, as in `plant.transmission`.
        steps: how the steps so far have ended, in their order.
    """

    robot: str
    drives: str = ""
    practice: str = ""
    realtime: bool = False
    torque_nm: Annotated[float, Field(gt=0.0)]
    speed_rad_s: Annotated[float, Field(gt=0.0)]
    imu: dict[str, Any] | None = None
    transmissions: dict[str, float] = Field(default_factory=dict)
    steps: Annotated[tuple[StepRecord, ...], Field(strict=False)] = ()

    def outcome_of(self, step: str) -> StepRecord | None:
        """Return how a step has ended, None where it has not been run."""
        return next((record for record in self.steps if record.step == step), None)

    def with_step(self, record: StepRecord) -> CommissionState:
        """Return the state after a step, whose earlier record and all behind it are dropped."""
        names = [step.step for step in self.steps]
        kept = self.steps[: names.index(record.step)] if record.step in names else self.steps
        return self.model_copy(update={"steps": (*kept, record)})

    def before(self, step: str) -> CommissionState:
        """Return the state as it was before a step."""
        names = [step.step for step in self.steps]
        return self.model_copy(update={"steps": self.steps[: names.index(step)] if step in names else self.steps})

    def write(self, folder: Path) -> None:
        """Write it as one file, at once.

        Raises:
            InputError: the folder cannot be written to.
        """
        content: Mapping[str, Any] = finite(self.model_dump(mode="json"))
        write_results(folder, {STATE_FILE: yaml_text(content)})


def resumed(folder: Path, asked: CommissionState) -> CommissionState:
    """Return the state in a folder, or a new one where there is nothing.

    Raises:
        InputError: the folder holds something else, or a commissioning that was begun otherwise.
    """
    path = folder / STATE_FILE
    if not path.exists():
        if folder.exists() and any(folder.iterdir()):
            raise InputError(
                f"{folder}: holds no {STATE_FILE}: expected a new or empty directory, or one to resume from"
            )
        return asked
    state = read_yaml(path, CommissionState)
    for key in ("robot", "drives", "practice", "realtime", "torque_nm", "speed_rad_s"):
        before, now = getattr(state, key), getattr(asked, key)
        if before != now:
            raise InputError(
                f"{path}: {key}: was begun with {before!r}, now {now!r}: expected the same, or another --out"
            )
    return state
