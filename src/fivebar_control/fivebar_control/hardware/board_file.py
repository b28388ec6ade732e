"""Configuration of one robot's motor board, read from a file and validated before the port is opened."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fivebar_control.hardware.configuration import MICROSECONDS, Milliseconds
from fivebar_control.model.singularity import NEAR_LOCUS
from fivebar_description.board_file import CLOCK, PEAK_CURRENT, BoardMotor
from fivebar_description.physical_bounds import Positive
from fivebar_description.share import share_file, yaml_path
from fivebar_description.strict_yaml import StrictModel, read_yaml

Angle = Annotated[float, Field(ge=-100.0, le=100.0)]


class BoardDrive(BoardMotor):
    """One motor: how the board's values are to be read, and what it may do; see `BoardMotor` for the other keys.

    Attributes:
        torque_limit_nm: largest torque that is ever commanded.
        current_limit: largest current (A) that is ever commanded.
    """

    torque_limit_nm: Positive
    current_limit: Annotated[float, Field(gt=0.0, le=PEAK_CURRENT)] = PEAK_CURRENT


class BoardDrivePair(StrictModel):
    """Section `motors`: the board's motor 0 on the left, its motor 1 on the right."""

    q11: BoardDrive
    q21: BoardDrive


class StartPosture(StrictModel):
    """Section `posture`: where the robot is said to stand when a run starts.

    Attributes:
        q11, q21: joint angles (rad).
        tolerance_rad: how far the encoders may be off.
    """

    q11: Angle
    q21: Angle
    tolerance_rad: Positive = 0.05


class BoardInnerLoop(StrictModel):
    """Section `inner_loop`: the board's own control of angle and speed, besides the law's torque; off by default.

    Attributes:
        stiffness: the board's kp (A/rad).
        damping: the board's kd (A/(rad/s)).
        share: largest part of a motor's current limit that both may command together.
        epsilon: kappa = 1/cond(A) up to which there is none of either; from twice that on they are whole.
        robot: file of the robot, for the joint angles of the reference.
    """

    stiffness: Annotated[float, Field(ge=0.0, le=50.0)] = 0.0
    damping: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    share: Annotated[float, Field(gt=0.0, le=0.5)] = 0.2
    epsilon: Annotated[float, Field(gt=0.0, lt=0.5)] = NEAR_LOCUS
    robot: Annotated[str, Field(min_length=1)] = "motkin"

    @property
    def on(self) -> bool:
        """Whether there is an inner loop."""
        return self.stiffness > 0.0 or self.damping > 0.0


class BoardFile(StrictModel):
    """One configuration file.

    Attributes:
        name: what people call this set-up.
        port: serial port of the board, such as /dev/ttyACM0.
        pace: `clock`, as of any real robot; or `commands`, for an emulated board whose robot moves on by one period
            with each of them: then a cycle begins late rather than without the torque that answers the last sample,
            and waits longer for its echo.
        period_us: period of the control loop; a whole number of them makes a second.
        watchdog_ms: time without a command after which the board takes both currents by itself.
        gather_deadline_us: how long after a command its echo is waited for.
        missing_limit: cycles in a row without a new state, or without an echo, beyond which it is a fault.
        set_up_timeout_ms: longest wait for the first echo.
        posture: where the robot must stand when a run starts; not checked when left out.
        inner_loop: the board's own control of angle and speed.
    """

    name: Annotated[str, Field(min_length=1)]
    port: Annotated[str, Field(min_length=1)]
    pace: Literal["clock", "commands"] = "clock"
    period_us: Annotated[int, Field(ge=1000, le=100_000)] = 2000
    watchdog_ms: Milliseconds = 20
    gather_deadline_us: Annotated[int, Field(ge=100, le=100_000)] = 1500
    missing_limit: Annotated[int, Field(ge=0, le=1000)] = 3
    set_up_timeout_ms: Milliseconds = 2000
    posture: StartPosture | None = None
    inner_loop: BoardInnerLoop = BoardInnerLoop()
    motors: BoardDrivePair

    @property
    def paced_by_commands(self) -> bool:
        """Whether time waits for the commands."""
        return self.pace != CLOCK

    @property
    def pair(self) -> tuple[BoardDrive, BoardDrive]:
        """The motors in the order of the joints, which is the board's."""
        return self.motors.q11, self.motors.q21

    @model_validator(mode="after")
    def _times_fit_together(self) -> Self:
        if MICROSECONDS % self.period_us:
            raise ValueError(f"period_us {self.period_us}: expected a divisor of 1000000")
        if self.gather_deadline_us >= self.period_us:
            raise ValueError(
                f"gather_deadline_us {self.gather_deadline_us}: expected less than period_us {self.period_us}"
            )
        if self.watchdog_ms * 1000 < 2 * self.period_us:
            raise ValueError(f"watchdog_ms {self.watchdog_ms}: expected at least two periods of {self.period_us} us")
        return self


def load_board(board: str) -> BoardFile:
    """Read a configuration by its shipped name ("motkin") or by the path of a YAML file.

    Raises:
        InputError: the file is missing or not a configuration; the text names file and key.
    """
    return read_yaml(board_path(board), BoardFile, ("inner_loop", "robot"))


def board_path(board: str) -> Path:
    """Return the configuration file for a shipped name or a path.

    Raises:
        InputError: no such name.
    """
    return yaml_path("board", board, share_file("fivebar_control", "config", "boards"))
