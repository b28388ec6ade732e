# SPDX-License-Identifier: Apache-2.0
"""Configuration of two emulated motors, in a file of its own so that it checks the bridge's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import Field

from fivebar_description.motors_file import FileMotor, PeriodUs, WatchdogMs
from fivebar_description.physical_bounds import Positive
from fivebar_description.strict_yaml import StrictModel
from fivebar_sim.emulation_file import EmulatedRobotFile


class MotorFacts(FileMotor):
    """One emulated motor; see `FileMotor` for the other keys.

    Attributes:
        current_limit: largest current (A); none when left out.
    """

    current_limit: Positive | None = None


class MotorFactsPair(StrictModel):
    """Section `motors`: the motor of each joint."""

    q11: MotorFacts
    q21: MotorFacts


class MotorsEmulationFile(EmulatedRobotFile):
    """One file; see `EmulatedRobotFile` for the other keys.

    Attributes:
        pace: what advances simulated time: `commands`, by one period with each pair of them, so that a run does not
            depend on the machine's speed; or `clock`, always, as on a robot.
        period_us: time from one command to the next.
        watchdog_ms: time without a command after which a drive takes its torque by itself.
        least_parts: parts of a period, at least, in each of which the drives' own control acts anew.
        link: bus or port, with the keys of the interface.
    """

    pace: Literal["commands", "clock"] = "commands"
    period_us: PeriodUs = 2000
    watchdog_ms: WatchdogMs = 20
    least_parts: Annotated[int, Field(ge=1, le=20)] = 1
    link: Mapping[str, Any] = Field(default_factory=dict)
    motors: MotorFactsPair

    @property
    def pair(self) -> tuple[MotorFacts, MotorFacts]:
        """The motors in the order of the joints."""
        return self.motors.q11, self.motors.q21
