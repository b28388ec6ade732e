"""Paths of the platform from rest to rest, without the time that they take, and where they meet the Type 2 locus."""

from __future__ import annotations

from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.compiling import as_machine_code
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import State
from fivebar_control.root_search import zero_between
from fivebar_control.trajectory.path import Segment
from fivebar_control.trajectory.rounded import RoundedPolyline, RoundedSegment
from fivebar_description.parameters import FiveBar, with_floats

SEARCH_STEPS = 400
"""Points per segment at which the sign of det A is sampled; two crossings closer than that count as none."""


class StraightWay(NamedTuple):
    """A straight path (m)."""

    start_x: float
    start_y: float
    end_x: float
    end_y: float

    @property
    def legs(self) -> int:
        """Number of legs."""
        return 1

    def at(self, s: float) -> tuple[float, float, float, float, float, float]:
        """Return the place (m) at a share s of the way, with its first and second derivative by s (m)."""
        d_x, d_y = self.end_x - self.start_x, self.end_y - self.start_y
        return self.start_x + s * d_x, self.start_y + s * d_y, d_x, d_y, 0.0, 0.0


Way = StraightWay | RoundedPolyline
"""A path from rest to rest, without the time that it takes."""


def way_of(segment: Segment | RoundedSegment) -> Way:
    """Return the way of a segment, whatever time it takes."""
    if isinstance(segment, RoundedSegment):
        return segment.curve
    return StraightWay(segment.start_x, segment.start_y, segment.end_x, segment.end_y)


def grid_along(way: Way) -> list[float]:
    """Return shares of a way at which it is searched: so many on each leg, the corners' ends among them."""
    if isinstance(way, StraightWay):
        return [step / SEARCH_STEPS for step in range(SEARCH_STEPS + 1)]
    count = SEARCH_STEPS * way.legs
    ends = (end for corner in way.corners() for end in corner)
    return sorted({*(step / count for step in range(count + 1)), *ends})


def state_on(robot: FiveBar, mode1: int, mode2: int, way: Way, s: float) -> State:
    """Return the robot at rest in a working mode, at a share of a way."""
    x, y = way.at(s)[:2]
    return state_from_platform(robot, mode1, mode2, x, y, 0.0, 0.0)


@lru_cache(maxsize=64)
def locus_fractions(robot: FiveBar, mode1: int, mode2: int, way: Way) -> tuple[float, ...]:
    """Return the fractions of a way at which det A changes its sign; the same for all durations and time laws."""

    def assembly(s: float) -> float:
        return det_a(state_on(robot, mode1, mode2, way, s))

    grid = grid_along(way)
    determinants = np.empty(len(grid))
    places = np.array([way.at(s)[:2] for s in grid])
    as_machine_code(write_determinants)(with_floats(robot), mode1, mode2, places, determinants)
    sides = (determinants > 0.0).tolist()
    return tuple(
        zero_between(assembly, grid[step], grid[step + 1], 1e-15)
        for step in range(len(grid) - 1)
        if sides[step] != sides[step + 1]
    )


def write_determinants(
    robot: FiveBar, mode1: int, mode2: int, places: NDArray[np.float64], determinants: NDArray[np.float64]
) -> None:
    """Write det A in a working mode, [N], for places of the platform (m), [N, 2]."""
    for number in range(len(places)):
        x, y = float(places[number, 0]), float(places[number, 1])
        determinants[number] = det_a(state_from_platform(robot, mode1, mode2, x, y, 0.0, 0.0))
