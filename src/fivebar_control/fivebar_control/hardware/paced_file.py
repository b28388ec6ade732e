# SPDX-License-Identifier: Apache-2.0
"""Common keys of configurations of drives, whatever the drives are: the period, what is waited for, and where."""

from __future__ import annotations

from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from fivebar_control.hardware.configuration import MICROSECONDS, CycledFile, Milliseconds, StartPosture, check_period
from fivebar_description.motors_file import BY_THE_CLOCK

PATIENCE = 2
"""Periods for which answers are waited for where the robot moves on with the commands alone."""


class PacedFile(CycledFile):
    """The keys of one configuration file that all of them share.

    Attributes:
        name: what people call this set-up.
        pace: `clock`, as of any real robot; or `commands`, for emulated drives whose robot moves on by one period with
            the commands: then a cycle begins late rather than without the torque that answers the last sample, and
            waits longer for the answers.
        period_us: period of the control loop; a whole number of them makes a second.
        watchdog_ms: time without a command after which the drives take their torque by themselves.
        gather_deadline_us: how long after a command its answer is waited for.
        set_up_timeout_ms: longest wait for the first answer.
        posture: where the robot must stand when a run starts; not checked when left out.
    """

    name: Annotated[str, Field(min_length=1)]
    pace: Literal["clock", "commands"] = "clock"
    period_us: int = 2000
    watchdog_ms: int = 20
    gather_deadline_us: Annotated[int, Field(ge=100, le=100_000)] = 1500
    set_up_timeout_ms: Milliseconds = 2000
    posture: StartPosture | None = None

    @property
    def paced_by_commands(self) -> bool:
        """Whether time waits for the commands."""
        return self.pace != BY_THE_CLOCK

    @property
    def patience(self) -> int:
        """Periods for which answers are waited for, more than one where the robot moves on with the commands alone."""
        return PATIENCE if self.paced_by_commands else 1

    @property
    def gather_time(self) -> float:
        """How long (s) after a command its answer is waited for."""
        return (self.gather_deadline_us + (self.patience - 1) * self.period_us) / MICROSECONDS

    @model_validator(mode="after")
    def _times_fit_together(self) -> Self:
        check_period("period_us", self.period_us, self.gather_deadline_us)
        if self.watchdog_ms * 1000 < 2 * self.period_us:
            raise ValueError(f"watchdog_ms {self.watchdog_ms}: expected at least two periods of {self.period_us} us")
        return self
