"""The postures in which the figures show the robot."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from fivebar_bringup.maps.fields import WORKING_MODES, Fields, posture
from fivebar_bringup.maps.loci import Curve, Loci
from fivebar_control.model.kinematics import det_a, state_from_joints, state_from_platform
from fivebar_control.model.singularity import inverse_condition, type1_margin
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar

EVERY = 7
"""One in so many of the postures known is looked at."""

MIDDLE = 2.0
"""How much (1/m) a posture loses by being away from the line x = 0: those near it are easier to read."""


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
    cells = [(float(grid.x[column]), float(grid.y[row])) for row, column in np.argwhere(grid.reach > 0.0)[::EVERY]]
    regular = {
        modes: max(
            (state_from_platform(robot, *modes, x, y, 0.0, 0.0) for x, y in cells),
            key=_readable(lambda state: min(type1_margin(state), inverse_condition(state))),
        )
        for modes in WORKING_MODES
    }
    first = regular[WORKING_MODES[0]]
    at_once = (state_from_joints(robot, *point.joints, 0.0, 0.0, 0.0, 0.0) for point in loci.type3)
    stretched = [piece.curve for piece in loci.type1 if piece.shape == "stretched"]
    crossing = [piece.curve for piece in loci.type2 if piece.working_mode == WORKING_MODES[0]]
    return Examples(
        regular,
        posture(robot, -1 if det_a(first) > 0.0 else 1, first.leg1.q1, first.leg2.q1),
        _best(robot, stretched or [piece.curve for piece in loci.type1], inverse_condition),
        _best(robot, crossing or [piece.curve for piece in loci.type2], type1_margin),
        max(at_once, key=lambda state: state.y, default=None),
    )


def _readable(quality: Callable[[State], float]) -> Callable[[State], float]:
    """Return a quality in [0, 1] that counts more above the base line and near x = 0."""
    return lambda state: quality(state) + (1.0 if state.y > 0.0 else 0.0) - MIDDLE * abs(state.x)


def _best(robot: FiveBar, curves: Iterable[Curve], quality: Callable[[State], float]) -> State | None:
    states = (
        state_from_joints(robot, *joints, 0.0, 0.0, 0.0, 0.0)
        for curve in curves
        for joints in curve.joints[::EVERY].tolist()
    )
    return max(states, key=_readable(quality), default=None)
