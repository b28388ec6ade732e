# SPDX-License-Identifier: Apache-2.0
"""The postures in which the figures show the robot."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from fivebar_control.model.kinematics import assembly_mode, state_from_joints, state_from_motors, state_from_platform
from fivebar_control.model.singularity import inverse_condition, type1_margin
from fivebar_control.model.state import State
from fivebar_control.planning.postures import WORKING_MODES
from fivebar_control.workspace.fields import Fields
from fivebar_control.workspace.loci import Curve, Loci
from fivebar_description.parameters import FiveBar

EVERY = 7
"""One in so many of the postures known is looked at."""

ABOVE, MIDDLE = 3.0, 0.8
"""How much a posture gains above the base line, and loses away from x = 0, per length of the plane's longer half."""


class Examples(NamedTuple):
    """States at rest to draw; those in the upper half of the plane are preferred.

    Attributes:
        regular: per working mode one far from all singularities.
        counterpart: the first working mode's, in the other assembly mode with the same motor angles.
        type1, type2: singular in one way and far from being so in the other; None where a robot has none.
        type3: singular in both ways.
    """

    regular: dict[tuple[int, int], State]
    counterpart: State
    type1: State | None
    type2: State | None
    type3: State | None


def choose(robot: FiveBar, loci: Loci, fields: Fields) -> Examples:
    """Return the postures to draw."""
    grid = fields.platform_grid
    scale = max(float(grid.x[-1]), float(grid.y[-1]))
    cells = [(float(grid.x[column]), float(grid.y[row])) for row, column in np.argwhere(grid.reach > 0.0)[::EVERY]]

    def regularity(state: State) -> float:
        return min(type1_margin(state), inverse_condition(state))

    def best(states: Iterable[State], quality: Callable[[State], float]) -> State | None:
        return max(states, key=lambda state: quality(state) + _readability(state, scale), default=None)

    regular = {}
    for modes in WORKING_MODES:
        states = [state_from_platform(robot, modes, x, y, 0.0, 0.0) for x, y in cells]
        regular[modes] = best(states, regularity) or states[0]
    first = regular[WORKING_MODES[0]]
    at_once = (state_from_joints(robot, *point.joints, 0.0, 0.0, 0.0, 0.0) for point in loci.type3)
    stretched = [piece.curve for piece in loci.type1 if piece.shape == "stretched"]
    crossing = [piece.curve for piece in loci.type2 if piece.working_mode == WORKING_MODES[0]]
    return Examples(
        regular,
        state_from_motors(robot, -assembly_mode(first), first.leg1.q1, first.leg2.q1, 0.0, 0.0),
        best(_along(robot, stretched or [piece.curve for piece in loci.type1]), inverse_condition),
        best(_along(robot, crossing or [piece.curve for piece in loci.type2]), type1_margin),
        max(at_once, key=lambda state: state.y, default=None),
    )


def _readability(state: State, scale: float) -> float:
    return min(ABOVE * state.y / scale, 1.0) - MIDDLE * abs(state.x) / scale


def _along(robot: FiveBar, curves: Iterable[Curve]) -> Iterable[State]:
    for curve in curves:
        for q11, q12, q21, q22 in curve.joints[::EVERY].tolist():
            yield state_from_joints(robot, q11, q12, q21, q22, 0.0, 0.0, 0.0, 0.0)
