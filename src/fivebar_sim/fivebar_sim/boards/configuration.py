"""Configuration of the emulated board, in a file of its own so that it checks the bridge's."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fivebar_description.board_file import PEAK_CURRENT, BoardMotor
from fivebar_description.parameters import Positive
from fivebar_description.settings import Keys
from fivebar_description.strict_yaml import StrictModel
from fivebar_sim.drives.configuration import NOT_EFFECTS, Four
from fivebar_sim.settings import FrictionScale, InertiaScale, MassScale, PlantSettings

CLOCK = "clock"


class BoardMotorFacts(BoardMotor):
    """One motor of the emulated board; see `BoardMotor` for the other keys.

    Attributes:
        current_limit: largest current (A).
        current_bandwidth_hz: bandwidth of the current loop, of first order.
        speed_bandwidth_hz: bandwidth of the filter of the speed that the board tells.
    """

    current_limit: Positive = PEAK_CURRENT
    current_bandwidth_hz: Positive = 300.0
    speed_bandwidth_hz: Positive = 50.0


class BoardMotorFactsPair(StrictModel):
    """Section `motors`: the board's motor 0 on the left, its motor 1 on the right."""

    q11: BoardMotorFacts = BoardMotorFacts()
    q21: BoardMotorFacts = BoardMotorFacts()


class BoardEmulationFile(StrictModel):
    """One file.

    Attributes:
        port: symbolic link to make to the pseudo-terminal; none when empty.
        robot: parameter file of the robot that the board moves.
        initial_joints: its posture at the start: q11, q12, q21, q22 in rad, of a closed loop.
        pace: what moves the robot on: `commands`, by one period each, so that a run does not depend on how fast the
            machine is, and the clock only once the watchdog has found them missing; or `clock`, always, as on a robot.
        period_us: time from one command to the next, for `pace: commands`.
        tick_us: time between two runs of the board's control, and state frames where the clock sets the pace.
        button_s: for how long the emergency stop button is to be held for the board to recover.
        mass_scale, inertia_scale, friction_scale: how the robot differs from its parameter file.
        effects: the robot's effects, what simulates them, and the seed of what is random in them.
    """

    name: Annotated[str, Field(min_length=1)]
    port: str = ""
    robot: str
    initial_joints: Four
    pace: Literal["commands", "clock"] = "commands"
    period_us: Annotated[int, Field(ge=500, le=100_000)] = 2000
    tick_us: Annotated[int, Field(ge=100, le=100_000)] = 1000
    button_s: Annotated[float, Field(ge=0.0, le=60.0)] = 3.0
    mass_scale: MassScale = 1.0
    inertia_scale: InertiaScale = 1.0
    friction_scale: FrictionScale = 1.0
    effects: Annotated[PlantSettings, Keys(without=NOT_EFFECTS)] = PlantSettings()
    motors: BoardMotorFactsPair = BoardMotorFactsPair()

    def plant(self) -> PlantSettings:
        """Return the settings of the robot; the board itself limits."""
        return self.effects._replace(
            mass_scale=self.mass_scale,
            inertia_scale=self.inertia_scale,
            friction_scale=self.friction_scale,
            torque_limit=None,
        )

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
