"""The postures in which the figures show the robot."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import NamedTuple

import numpy as np

from fivebar_bringup.maps.fields import WORKING_MODES, Fields, posture
from fivebar_bringup.maps.loci import Curve, Loci, Type3
from fivebar_control.model.kinematics import det_a, state_from_joints, state_from_platform
from fivebar_control.model.singularity import inverse_condition, type1_margin
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar

EVERY = 7
"""One in so many of the postures known is looked at."""


class Example(NamedTuple):
    """A posture to draw: motor angles q11, q21 (rad), platform (m)."""

    motors: tuple[float, float]
    place: tuple[float, float]


class Examples(NamedTuple):
    """Postures to draw; those in the upper half of the plane are preferred.

    Attributes:
        regular: per working mode the posture farthest from all singularities.
        counterpart: the first working mode's posture in the other assembly mode, with the same motor angles.
        assembly: sign of det A of each regular posture.
        type1, type2: singular in one way and far from being so in the other; None where a robot has none.
        type3: singular in both ways.
    """

    regular: dict[tuple[int, int], Example]
    counterpart: Example
    assembly: dict[tuple[int, int], int]
    type1: Example | None
    type2: Example | None
    type3: Example | None


def choose(robot: FiveBar, loci: Loci, fields: Fields) -> Examples:
    """Return the postures to draw."""
    grid = fields.platform_grid
    cells = [(float(grid.x[column]), float(grid.y[row])) for row, column in np.argwhere(grid.reach > 0.0)[::EVERY]]
    regular: dict[tuple[int, int], Example] = {}
    assembly: dict[tuple[int, int], int] = {}
    for modes in WORKING_MODES:
        states = (state_from_platform(robot, *modes, x, y, 0.0, 0.0) for x, y in cells)
        best = max(states, key=_preferring_above(lambda state: min(type1_margin(state), inverse_condition(state))))
        regular[modes] = _example(best)
        assembly[modes] = 1 if det_a(best) > 0.0 else -1
    first = WORKING_MODES[0]
    return Examples(
        regular,
        _example(posture(robot, -assembly[first], *regular[first].motors)),
        assembly,
        _best(robot, (piece.curve for piece in loci.type1 if piece.shape == "stretched"), inverse_condition),
        _best(robot, (piece.curve for piece in loci.type2 if piece.working_mode == first), type1_margin),
        _type3(loci.type3),
    )


def _preferring_above(quality: Callable[[State], float]) -> Callable[[State], float]:
    """Return a quality in [0, 1] that counts more above the base line."""
    return lambda state: quality(state) + (1.0 if state.y > 0.0 else 0.0)


def _best(robot: FiveBar, curves: Iterable[Curve], quality: Callable[[State], float]) -> Example | None:
    states = (
        state_from_joints(robot, *joints, 0.0, 0.0, 0.0, 0.0)
        for curve in curves
        for joints in curve.joints[::EVERY].tolist()
    )
    best = max(states, key=_preferring_above(quality), default=None)
    return None if best is None else _example(best)


def _example(state: State) -> Example:
    return Example((state.leg1.q1, state.leg2.q1), (state.x, state.y))


def _type3(points: list[Type3]) -> Example | None:
    highest = max(points, key=lambda point: point.y, default=None)
    return None if highest is None else Example((highest.joints.q11, highest.joints.q21), (highest.x, highest.y))
