# SPDX-License-Identifier: Apache-2.0
"""Postures that a robot's user forbids: the list `forbidden` of a robot file."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Annotated, NamedTuple, Self

from pydantic import Field, model_validator

from fivebar_description.strict_yaml import StrictModel

MOST = 4
"""Largest number of forbidden postures of a robot."""

EVERYWHERE = (-1e3, 1e3)
"""Range (m) of a coordinate that is left out."""

ANY_ANGLE = (-math.pi, math.pi)
"""Range (rad) of an angle that is left out: a whole turn."""

Bound = Annotated[float, Field(ge=-1e3, le=1e3)]
Range = Annotated[tuple[Bound, Bound], Field(strict=False)]


class PostureBounds(NamedTuple):
    """Ranges of the platform's place (m) and of the motors' angles (rad, whatever the turn) that hold at once."""

    x_min: float
    x_max: float
    y_min: float
    y_max: float
    q11_min: float
    q11_max: float
    q21_min: float
    q21_max: float


SIZE = len(PostureBounds._fields)

NOWHERE = PostureBounds(*(1.0, -1.0) * 4)
"""In place of a posture where there are fewer than `MOST`: its ranges are empty."""


class ForbiddenPosture(StrictModel):
    """One forbidden posture: the robot is in it while all quantities are in their ranges; one left out may be any.

    Attributes:
        name: what refusals call it.
        x, y: least and largest coordinate of the platform (m).
        q11, q21: least and largest angle of the motors (rad); a range of a turn or more is any angle.
    """

    name: Annotated[str, Field(min_length=1)]
    x: Range = EVERYWHERE
    y: Range = EVERYWHERE
    q11: Range = ANY_ANGLE
    q21: Range = ANY_ANGLE

    @model_validator(mode="after")
    def _says_something(self) -> Self:
        problem = problem_of(self.bounds())
        if problem is not None:
            raise ValueError(problem)
        if (self.x, self.y, self.q11, self.q21) == (EVERYWHERE, EVERYWHERE, ANY_ANGLE, ANY_ANGLE):
            raise ValueError("expected a range of x, y, q11 or q21: without any, every posture is forbidden")
        return self

    def bounds(self) -> PostureBounds:
        """Return the ranges as numbers."""
        return PostureBounds(*self.x, *self.y, *self.q11, *self.q21)


def motor_range(postures: Sequence[ForbiddenPosture], joint: str, home: float) -> tuple[float, float] | None:
    """Return the range (rad) of a motor, `q11` or `q21`, that forbidden postures of its angle alone leave around home.

    None where there are none.
    """
    ends = [getattr(posture, joint) for posture in postures if posture.model_fields_set - {"name"} == {joint}]
    if not ends:
        return None
    turn = 2.0 * math.pi
    lower = max(last + turn * math.floor((home - last) / turn) for _, last in ends)
    upper = min(first + turn * math.ceil((home - first) / turn) for first, _ in ends)
    return lower, upper


class NamedBounds(NamedTuple):
    """A forbidden posture as the planner takes it: its name and its ranges."""

    name: str
    bounds: PostureBounds


def numbers_of(postures: Sequence[ForbiddenPosture]) -> tuple[float, ...]:
    """Return all ranges in one row, as a node's parameter holds them."""
    return tuple(float(number) for posture in postures for number in posture.bounds())


def bounds_in(numbers: Sequence[float]) -> tuple[PostureBounds, ...]:
    """Return the ranges that are written in one row."""
    return tuple(PostureBounds(*map(float, numbers[at : at + SIZE])) for at in range(0, len(numbers), SIZE))


def kept_clear_of(numbers: Sequence[float], postures: Sequence[ForbiddenPosture]) -> tuple[NamedBounds, ...]:
    """Return the postures that a robot may not enter: those in one row, named by place, else those of its file."""
    listed = tuple(NamedBounds(f"{place}", bounds) for place, bounds in enumerate(bounds_in(numbers), start=1))
    return listed or tuple(NamedBounds(posture.name, posture.bounds()) for posture in postures)


def numbers_problem(numbers: Sequence[float]) -> str | None:
    """Return what is wrong with ranges in one row, None if nothing."""
    if len(numbers) % SIZE or len(numbers) > MOST * SIZE:
        return f"expected {SIZE} numbers for each of at most {MOST} postures"
    return next(filter(None, map(problem_of, bounds_in(numbers))), None)


def problem_of(bounds: PostureBounds) -> str | None:
    """Return what is wrong with ranges, None if nothing."""
    for name, low, high in zip(("x", "y", "q11", "q21"), bounds[::2], bounds[1::2], strict=True):
        if not low < high:
            return f"{name}: expected the least value before the largest one"
    return None
