# SPDX-License-Identifier: Apache-2.0
"""Shapes of a scene: what a marker of RViz says, as plain values."""

from __future__ import annotations

import math
from collections.abc import Iterable
from enum import IntEnum
from typing import NamedTuple

Point = tuple[float, float, float]
"""Place in the base frame (m)."""

Colour = tuple[float, float, float, float]
"""Red, green, blue and opacity, from 0 to 1."""

PLANE = 0.002
"""Height at which what lies in the plane is drawn (m): on the base plate, under the links."""

ABOVE = 0.05
"""Height of what is drawn over the links (m)."""

INK: Colour = (0.12, 0.14, 0.19, 1.0)
GREY: Colour = (0.42, 0.45, 0.50, 1.0)
PALE: Colour = (0.73, 0.75, 0.80, 1.0)
BLUE: Colour = (0.00, 0.45, 0.70, 1.0)
VERMILION: Colour = (0.84, 0.37, 0.00, 1.0)
GREEN: Colour = (0.00, 0.62, 0.45, 1.0)
PURPLE: Colour = (0.61, 0.31, 0.59, 1.0)
YELLOW: Colour = (0.94, 0.75, 0.20, 1.0)


class Kind(IntEnum):
    """Kinds of shapes, with the numbers of visualization_msgs/Marker."""

    ARROW = 0
    LINE_STRIP = 4
    LINE_LIST = 5
    SPHERES = 7
    TEXT = 9


class Shape(NamedTuple):
    """One shape; without points it is absent, and takes one of the same name from the picture.

    Attributes:
        group: what it belongs to; a group can be hidden as a whole.
        number: which one of its group.
        kind: line, arrow from the first point to the second, spheres at the points, or text at the first point.
        points: in the base frame (m).
        colour: of the whole shape.
        size: width of a line, diameter of spheres, height of letters; an arrow's head is twice as wide (m).
        colours: of each point, where they differ.
        text: of a text.
    """

    group: str
    number: int
    kind: Kind
    points: tuple[Point, ...]
    colour: Colour
    size: float
    colours: tuple[Colour, ...] = ()
    text: str = ""


def faded(colour: Colour, opacity: float) -> Colour:
    """Return a colour with another opacity."""
    return (*colour[:3], opacity)


def in_plane(places: Iterable[tuple[float, float]], height: float = PLANE) -> tuple[Point, ...]:
    """Return places of the robot's plane (m) at a height (m)."""
    return tuple((float(x), float(y), height) for x, y in places)


def arc(x: float, y: float, radius: float, start: float, turn: float, height: float) -> tuple[Point, ...]:
    """Return an arc around (x, y), from an angle by a turn (rad), with an arrow's head at its end; () for no turn."""
    if turn == 0.0:
        return ()
    steps = max(2, math.ceil(abs(turn) / 0.1))
    angles = [start + turn * step / steps for step in range(steps + 1)]
    line = [(x + radius * math.cos(angle), y + radius * math.sin(angle), height) for angle in angles]
    back = angles[-1] - math.copysign(min(0.35, 0.5 * abs(turn)), turn)
    head = [
        (x + share * radius * math.cos(back), y + share * radius * math.sin(back), height) for share in (0.75, 1.25)
    ]
    return (*line, head[0], line[-1], head[1])
