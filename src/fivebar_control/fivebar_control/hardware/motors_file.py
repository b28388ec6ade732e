"""Configuration of two motors of any interface, read from a file and validated before their bus or port is opened."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from fivebar_control.hardware.board_file import StartPosture
from fivebar_control.hardware.configuration import MICROSECONDS, Milliseconds
from fivebar_description.board_file import CLOCK
from fivebar_description.motors_file import FileMotor, PeriodUs, WatchdogMs
from fivebar_description.physical_bounds import Positive
from fivebar_description.share import share_file, yaml_path
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


class MotorsFile(StrictModel):
    """One configuration file.

    Attributes:
        name: what people call this set-up.
        interface: the registered interface of the drives, or MODULE:NAME.
        period_us: period of the control loop; a whole number of them makes a second.
        gather_deadline_us: how long after the commands the drives' answers are waited for.
        missing_limit: cycles in a row without a drive's answer beyond which it is a fault.
        watchdog_ms: time without a command after which a drive takes its torque by itself.
        set_up_timeout_ms: longest wait for the first answers.
        posture: where the robot must stand when a run starts; not checked when left out.
        pace: `clock`, as of any real robot; or `commands`, for emulated drives whose robot moves on by one period with
            each pair of them: then a cycle begins late rather than without the torque that answers the last sample.
        link: bus or port, with the keys of the interface.
    """

    name: Annotated[str, Field(min_length=1)]
    interface: Annotated[str, Field(min_length=1)]
    period_us: PeriodUs = 2000
    gather_deadline_us: Annotated[int, Field(ge=100, le=100_000)] = 1500
    missing_limit: Annotated[int, Field(ge=0, le=1000)] = 3
    watchdog_ms: WatchdogMs = 20
    set_up_timeout_ms: Milliseconds = 2000
    posture: StartPosture | None = None
    pace: Literal["clock", "commands"] = "clock"
    link: Mapping[str, Any] = Field(default_factory=dict)
    motors: DrivenPair

    @property
    def paced_by_commands(self) -> bool:
        """Whether time waits for the commands."""
        return self.pace != CLOCK

    @property
    def pair(self) -> tuple[DrivenMotor, DrivenMotor]:
        """The motors in the order of the joints."""
        return self.motors.q11, self.motors.q21

    @model_validator(mode="after")
    def _keys_fit_together(self) -> Self:
        if MICROSECONDS % self.period_us:
            raise ValueError(f"period_us {self.period_us}: expected a divisor of 1000000")
        if self.gather_deadline_us >= self.period_us:
            raise ValueError(
                f"gather_deadline_us {self.gather_deadline_us}: expected less than period_us {self.period_us}"
            )
        if self.watchdog_ms * 1000 < 2 * self.period_us:
            raise ValueError(f"watchdog_ms {self.watchdog_ms}: expected at least two periods of {self.period_us} us")
        if self.motors.q11.id == self.motors.q21.id:
            raise ValueError(f"motors: id {self.motors.q11.id} of both q11 and q21: expected two different ones")
        return self


def load_motors(configuration: str) -> MotorsFile:
    """Read a configuration by its shipped name ("odrive") or by the path of a YAML file.

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
