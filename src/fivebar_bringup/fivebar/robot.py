# SPDX-License-Identifier: Apache-2.0
"""Robots: their parameters, and where they are singular."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

from fivebar_control.model.kinematics import assembly_mode, state_from_platform
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import WorkingMode
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import RobotFile, read_robot


class Posture(NamedTuple):
    """The robot with its platform at one point, in one working mode.

    Attributes:
        q11, q12, q21, q22: active and passive joint angles of both legs (rad).
        assembly_mode: +1 or -1, the sign of det A.
        inverse_condition: 1/cond(A), 0 on the Type 2 locus.
    """

    q11: float
    q12: float
    q21: float
    q22: float
    assembly_mode: int
    inverse_condition: float


class Robot(NamedTuple):
    """A five-bar robot.

    Attributes:
        source: the name or path that it was loaded by, as scenarios take it.
        file: its robot file.
    """

    source: str
    file: RobotFile

    def __repr__(self) -> str:
        """Return which robot it is; `file` has all that is known of it."""
        return f"<Robot {self.name} ({self.source}): home at ({self.home[0]:.4g}, {self.home[1]:.4g}) m>"

    @property
    def name(self) -> str:
        """The name in its file."""
        return self.file.name

    @property
    def parameters(self) -> FiveBar:
        """Lengths, inertias, mass and friction, as the equations take them."""
        return self.file.five_bar()

    @property
    def home(self) -> tuple[float, float]:
        """Where the platform rests by default (m)."""
        return self.file.home_m

    def posture(self, x: float, y: float, working_mode: WorkingMode = (1, -1)) -> Posture:
        """Return the posture with the platform at (x, y) m.

        Args:
            x: of the platform (m).
            y: of the platform (m).
            working_mode: elbow side of each leg, +1 counter-clockwise of the line from base to platform.

        Raises:
            ValueError: the point is out of reach.

        Examples:
            >>> import fivebar
            >>> above = fivebar.load_robot("dextar").posture(0.0, 0.15)
            >>> below = fivebar.load_robot("dextar").posture(0.0, 0.02)
            >>> above.assembly_mode, below.assembly_mode
            (1, -1)
            >>> round(above.inverse_condition, 3)
            0.904
        """
        state = state_from_platform(self.parameters, working_mode, x, y, 0.0, 0.0)
        condition = inverse_condition(state)
        if math.isnan(condition):
            raise ValueError(f"({x:g}, {y:g}) m is out of reach")
        leg1, leg2 = state.leg1, state.leg2
        return Posture(leg1.q1, leg1.q2, leg2.q1, leg2.q2, assembly_mode(state), condition)


def load_robot(robot: str | Path = "dextar") -> Robot:
    """Read a robot by the name of a shipped one ("dextar", "motkin", "unequal") or from a robot file (.yaml).

    Raises:
        InputError: the file is missing or does not describe a five-bar.

    Examples:
        >>> import fivebar
        >>> fivebar.load_robot("dextar").parameters.leg1.proximal
        0.09
    """
    source = str(robot)
    return Robot(source, read_robot(source))
