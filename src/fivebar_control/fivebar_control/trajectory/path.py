# SPDX-License-Identifier: Apache-2.0
"""A path through waypoints, at rest between its segments: straight ones, polylines with rounded corners, splines, and
some that are planned in motor angles.

Its way is the path from rest to rest without the time that it takes; where that meets the Type 2 locus depends on
neither duration nor time law.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import lru_cache
from itertools import pairwise
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from fivebar_control.compiling import as_machine_code
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform, State, WorkingMode
from fivebar_control.root_search import zero_between
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.rounded import RoundedPolyline, RoundedSegment
from fivebar_control.trajectory.spline import SplineSegment
from fivebar_control.trajectory.time_scaling import TimeLaw, progress, rest_to_rest, time_fraction
from fivebar_description.parameters import FiveBar, with_floats


class Segment(NamedTuple):
    """One straight motion from rest to rest: start and end (m), start time and duration (s), and how time passes."""

    start_x: float
    start_y: float
    end_x: float
    end_y: float
    start_time: float
    duration: float
    time_law: TimeLaw = rest_to_rest

    def at(self, t: float) -> Platform:
        """Return the reference at time t (s); before and after the segment the platform rests at its ends."""
        return self.moved(*progress(self.time_law, t - self.start_time, self.duration))

    def moved(self, s: float, ds: float, dds: float) -> Platform:
        """Return the platform at a share of the way, given its two derivatives by time (1/s, 1/s^2)."""
        dx, dy = self.end_x - self.start_x, self.end_y - self.start_y
        return Platform(self.start_x + dx * s, self.start_y + dy * s, dx * ds, dy * ds, dx * dds, dy * dds)

    def time_at(self, s: float) -> float:
        """Return when the platform has gone a share of the way (s)."""
        return self.start_time + time_fraction(self.time_law, s) * self.duration

    def line_at(self, t: float) -> Line:
        """Return the segment as a line, the same at any time (s)."""
        dx, dy = self.end_x - self.start_x, self.end_y - self.start_y
        length = math.hypot(dx, dy)
        return Line(self.start_x, self.start_y, dx / length, dy / length)


SEARCH_STEPS = 400
"""Points per segment at which the sign of det A is sampled; two crossings closer than that count as none."""

AnySegment = Segment | RoundedSegment | JointSegment | SplineSegment


class Path:
    """The whole reference motion, as a function of the time since sample 0."""

    def __init__(self, segments: Sequence[AnySegment], rest_until: float = 0.0) -> None:
        """Join segments, each beginning where the last one ends, and then or later, after a rest.

        After the last one the platform rests until a time (s), if that is later.
        """
        self.segments = tuple(segments)
        self.duration = max(segments[-1].start_time + segments[-1].duration, rest_until)
        # of a straight segment once, since it is asked for at every sample
        self._lines = tuple(
            None if isinstance(segment, RoundedSegment) else segment.line_at(segment.start_time) for segment in segments
        )

    @classmethod
    def through(cls, waypoints: Sequence[tuple[float, float]], durations: Sequence[float]) -> Path:
        """Return the path of fifth-order polynomials through waypoints (m), with one duration (s) per segment."""
        segments = []
        start_time = 0.0
        for ((start_x, start_y), (end_x, end_y)), duration in zip(pairwise(waypoints), durations, strict=True):
            segments.append(Segment(start_x, start_y, end_x, end_y, start_time, duration))
            start_time += duration
        return cls(segments)

    def segment_index(self, t: float) -> int:
        """Return the number of the segment at time t; the instant between two belongs to the later one."""
        index = len(self.segments) - 1
        while index > 0 and t < self.segments[index].start_time:
            index -= 1
        return index

    def straight(self, index: int) -> Segment:
        """Return a segment that is known to be straight."""
        segment = self.segments[index]
        assert isinstance(segment, Segment)
        return segment

    def at(self, t: float) -> Platform:
        """Return the reference at time t (s); after the end the platform rests at the last waypoint."""
        return self.segments[self.segment_index(t)].at(t)

    def line_at(self, t: float) -> Line:
        """Return the line of the segment at time t (s), where it is rounded the tangent."""
        index = self.segment_index(t)
        line, segment = self._lines[index], self.segments[index]
        if isinstance(segment, RoundedSegment):
            return segment.line_at(t)
        assert line is not None
        return line

    def samples(self, rate_hz: int) -> int:
        """Return N, the number of the last sample: samples 0 to N cover the whole motion."""
        # a whole number of periods may come out a rounding error above itself
        return math.ceil(self.duration * rate_hz - 1e-6)


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


class AnyWay(Protocol):
    """A way, of which only the places are asked for."""

    def at(self, s: float) -> tuple[float, float, float, float, float, float]:
        """Return the place (m) at a share s of the way, with its first and second derivative by s (m)."""


def state_on(robot: FiveBar, mode: WorkingMode, way: AnyWay, s: float) -> State:
    """Return the robot at rest in a working mode, at a share of a way."""
    x, y = way.at(s)[:2]
    return state_from_platform(robot, mode, x, y, 0.0, 0.0)


@lru_cache(maxsize=64)
def locus_fractions(robot: FiveBar, mode: WorkingMode, way: Way) -> tuple[float, ...]:
    """Return the fractions of a way at which det A changes its sign; the same for all durations and time laws."""
    return crossings_on(robot, mode, way, grid_along(way))


def crossings_on(robot: FiveBar, mode: WorkingMode, way: AnyWay, grid: Sequence[float]) -> tuple[float, ...]:
    """Return the fractions of a way at which det A changes its sign between points of a grid."""

    def assembly(s: float) -> float:
        return det_a(state_on(robot, mode, way, s))

    determinants = np.empty(len(grid))
    places = np.array([way.at(s)[:2] for s in grid])
    as_machine_code(write_determinants)(with_floats(robot), mode, places, determinants)
    sides = (determinants > 0.0).tolist()
    return tuple(
        zero_between(assembly, grid[step], grid[step + 1], 1e-15)
        for step in range(len(grid) - 1)
        if sides[step] != sides[step + 1]
    )


def write_determinants(
    robot: FiveBar, mode: WorkingMode, places: NDArray[np.float64], determinants: NDArray[np.float64]
) -> None:
    """Write det A in a working mode, [N], for places of the platform (m), [N, 2]."""
    for number in range(len(places)):
        x, y = float(places[number, 0]), float(places[number, 1])
        determinants[number] = det_a(state_from_platform(robot, mode, x, y, 0.0, 0.0))
