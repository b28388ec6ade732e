# SPDX-License-Identifier: Apache-2.0
"""Configuration of the emulated board, in a file of its own so that it checks the bridge's."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fivebar_description.physical_bounds import Positive
from fivebar_description.strict_yaml import StrictModel
from fivebar_motkin_description.board_motor import PEAK_CURRENT, BoardMotor
from fivebar_sim.emulation_file import EmulatedRobotFile


class BoardMotorFacts(BoardMotor):
    """One motor of the emulated board; see `BoardMotor` for the other keys.

    Attributes:
        current_limit: largest current (A).
        current_bandwidth_hz: bandwidth of the current loop, of first order.
        speed_bandwidth_hz: bandwidth of the filter of the reported speed.
    """

    current_limit: Positive = PEAK_CURRENT
    current_bandwidth_hz: Positive = 300.0
    speed_bandwidth_hz: Positive = 50.0


class BoardMotorFactsPair(StrictModel):
    """Section `motors`: the board's motor 0 on the left, its motor 1 on the right."""

    q11: BoardMotorFacts = BoardMotorFacts()
    q21: BoardMotorFacts = BoardMotorFacts()


class BoardEmulationFile(EmulatedRobotFile):
    """One file; see `EmulatedRobotFile` for the other keys.

    Attributes:
        port: symbolic link to make to the pseudo-terminal; none when empty.
        pace: what advances simulated time: `commands`, by one period each, so that a run does not depend on the
            machine's speed, and the clock once the watchdog has found them missing; or `clock`, always, as on a robot.
        period_us: time from one command to the next, for `pace: commands`.
        tick_us: time between two runs of the board's control, and state frames where the clock sets the pace.
        button_s: for how long the emergency stop button is to be held for the board to recover.
    """

    port: str = ""
    pace: Literal["commands", "clock"] = "commands"
    period_us: Annotated[int, Field(ge=500, le=100_000)] = 2000
    tick_us: Annotated[int, Field(ge=100, le=100_000)] = 1000
    button_s: Annotated[float, Field(ge=0.0, le=60.0)] = 3.0
    motors: BoardMotorFactsPair = BoardMotorFactsPair()

    @property
    def pair(self) -> tuple[BoardMotorFacts, BoardMotorFacts]:
        """The motors in the order of the motor joints."""
        return self.motors.q11, self.motors.q21

    @property
    def ticks(self) -> int:
        """Ticks from one command to the next."""
        return max(1, round(self.period_us / self.tick_us))

    @property
    def tick(self) -> float:
        """Time (s) of one tick: a whole number of them makes a period."""
        return self.period_us / self.ticks / 1e6
