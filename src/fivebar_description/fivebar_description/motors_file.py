# SPDX-License-Identifier: Apache-2.0
"""Common keys of the bridge's configuration of two motors and of the file of their emulation.

Each side reads a file of its own, as on a real robot, so that each checks the other; what a key means and which values
it takes stands here once.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fivebar_description.physical_bounds import Positive, TorqueConstant
from fivebar_description.strict_yaml import StrictModel

PeriodUs = Annotated[int, Field(ge=500, le=100_000)]
WatchdogMs = Annotated[int, Field(ge=1, le=10_000)]

BY_THE_CLOCK = "clock"
"""The pace of a real robot."""


class FileMotor(StrictModel):
    """One motor with its drive and encoder.

    Attributes:
        id: the drive's number on its bus or port.
        gear_ratio: motor revolutions per revolution of the joint; 1 for a direct drive.
        sign: +1 where the drive counts up as the joint angle grows, else -1.
        counts_per_revolution: encoder counts per revolution of the motor.
        zero_rad: joint angle (rad) where the drive reads 0.
        torque_constant: torque (Nm) at the motor per current (A).
    """

    id: Annotated[int, Field(ge=0, le=127)]
    gear_ratio: Positive = 1.0
    sign: Literal[1, -1] = 1
    counts_per_revolution: Annotated[int, Field(ge=16, le=2**31 - 1)]
    zero_rad: Annotated[float, Field(ge=-100.0, le=100.0)] = 0.0
    torque_constant: TorqueConstant = 1.0
