# SPDX-License-Identifier: Apache-2.0
"""Common keys of the bridge's configuration of a motor board and of the file of the emulated board.

Each side reads a file of its own, as on a real robot, so that each checks the other; what a key means and which values
it takes stands here once.
"""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from fivebar_description.physical_bounds import TorqueConstant
from fivebar_description.strict_yaml import StrictModel

TORQUE_CONSTANT = 0.062
"""Measured torque constant (Nm/A) of the bench's GM3506 motors."""

PEAK_CURRENT = 3.0
"""Largest current (A) that the board drives through a motor."""

NORTH = 1.5707963267948966
"""Joint angle (rad) of a crank that points along +y, where the bench's encoders read 0."""


class BoardMotor(StrictModel):
    """One motor of the board with its absolute encoder.

    Attributes:
        counts_per_revolution: encoder counts per turn.
        sign: +1 where the reading grows counter-clockwise, as joint angles do, else -1.
        zero_rad: joint angle where the board's own calibration reads 0.
        torque_constant: torque (Nm) per current (A).
    """

    counts_per_revolution: Annotated[int, Field(ge=16, le=2**24)] = 16384
    sign: Literal[1, -1] = -1
    zero_rad: Annotated[float, Field(ge=-100.0, le=100.0)] = NORTH
    torque_constant: TorqueConstant = TORQUE_CONSTANT
