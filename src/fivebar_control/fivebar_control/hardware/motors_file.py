# SPDX-License-Identifier: Apache-2.0
"""Configuration of two motors of any interface, read from a file and validated before their bus or port is opened."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Self

from pydantic import Field, model_validator

from fivebar_control.hardware.paced_file import PacedFile
from fivebar_description.files import share_file, yaml_path
from fivebar_description.motors_file import FileMotor, PeriodUs, WatchdogMs
from fivebar_description.physical_bounds import Positive
from fivebar_description.strict_yaml import StrictModel, read_yaml


class DrivenMotor(FileMotor):
    """One motor: how the drive's values are to be read, and what it may do; see `FileMotor` for the other keys.

    Attributes:
        torque_limit_nm: largest torque (Nm) that is ever commanded, at the joint.
        current_limit: largest current (A) that is ever commanded; only the torque is limited when left out.
    """

    torque_limit_nm: Positive
    current_limit: Positive | None = None

    @property
    def shaft_torque_limit(self) -> float:
        """Largest torque (Nm) at the motor's shaft."""
        limit = self.torque_limit_nm / self.gear_ratio
        return limit if self.current_limit is None else min(limit, self.current_limit * self.torque_constant)


class DrivenPair(StrictModel):
    """Section `motors`: the motor of each joint."""

    q11: DrivenMotor
    q21: DrivenMotor


class MotorsFile(PacedFile):
    """One configuration file; see `PacedFile` for the other keys.

    Attributes:
        interface: the registered interface of the drives, or MODULE:NAME.
        link: bus or port, with the keys of the interface.
    """

    interface: Annotated[str, Field(min_length=1)]
    period_us: PeriodUs = 2000
    watchdog_ms: WatchdogMs = 20
    link: Mapping[str, Any] = Field(default_factory=dict)
    motors: DrivenPair

    @property
    def pair(self) -> tuple[DrivenMotor, DrivenMotor]:
        """The motors in the order of the joints."""
        return self.motors.q11, self.motors.q21

    @model_validator(mode="after")
    def _ids_differ(self) -> Self:
        if self.motors.q11.id == self.motors.q21.id:
            raise ValueError(f"motors: id {self.motors.q11.id} of both q11 and q21: expected two different ones")
        return self


def load_motors(configuration: str) -> MotorsFile:
    """Read a configuration by its shipped name ("ros2_control") or by the path of a YAML file.

    Raises:
        InputError: the file is missing or not a configuration; the text names file and key.
    """
    return read_yaml(motors_path(configuration), MotorsFile)


def motors_path(configuration: str) -> Path:
    """Return the configuration file for a shipped name or a path.

    Raises:
        InputError: no such name.
    """
    return yaml_path("drives", configuration, share_file("fivebar_control", "config", "motors"))
