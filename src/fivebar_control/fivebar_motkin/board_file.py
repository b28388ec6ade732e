# SPDX-License-Identifier: Apache-2.0
"""Configuration of one robot's motor board, read from a file and validated before the port is opened."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from pydantic import Field

from fivebar_control.hardware.configuration import Milliseconds
from fivebar_control.hardware.inner_loop import InnerLoopSettings
from fivebar_control.hardware.paced_file import PacedFile
from fivebar_description.files import share_file, yaml_path
from fivebar_description.physical_bounds import Positive
from fivebar_description.strict_yaml import StrictModel, read_yaml
from fivebar_motkin_description.board_motor import PEAK_CURRENT, BoardMotor


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


class BoardInnerLoop(InnerLoopSettings):
    """Section `inner_loop`, with what the board takes (A/rad, A/(rad/s)); see `InnerLoopSettings`."""

    stiffness: Annotated[float, Field(ge=0.0, le=50.0)] = 0.0
    damping: Annotated[float, Field(ge=0.0, le=1.0)] = 0.0
    robot: Annotated[str, Field(min_length=1)] = "motkin"


class BoardFile(PacedFile):
    """One configuration file; see `PacedFile` for the other keys. A command is answered by its echo.

    Attributes:
        port: serial port of the board, such as /dev/ttyACM0.
        inner_loop: the board's own control of angle and speed.
    """

    port: Annotated[str, Field(min_length=1)]
    period_us: Annotated[int, Field(ge=1000, le=100_000)] = 2000
    watchdog_ms: Milliseconds = 20
    inner_loop: BoardInnerLoop = BoardInnerLoop()
    motors: BoardDrivePair

    @property
    def pair(self) -> tuple[BoardDrive, BoardDrive]:
        """The motors in the order of the joints, which is the board's."""
        return self.motors.q11, self.motors.q21


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
