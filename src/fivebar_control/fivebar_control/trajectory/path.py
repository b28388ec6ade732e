"""A path through waypoints, at rest between its segments: straight ones, polylines with rounded corners, splines, and
some that are planned in motor angles.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.rounded import RoundedSegment
from fivebar_control.trajectory.spline import SplineSegment
from fivebar_control.trajectory.time_law import TimeLaw, progress, rest_to_rest, time_fraction


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
        return self.line()

    def line(self) -> Line:
        """Return the segment as a line."""
        dx, dy = self.end_x - self.start_x, self.end_y - self.start_y
        length = math.hypot(dx, dy)
        return Line(self.start_x, self.start_y, dx / length, dy / length)


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
        self._lines = tuple(None if isinstance(one, RoundedSegment) else one.line() for one in segments)

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
