# SPDX-License-Identifier: Apache-2.0
"""Polylines whose corners are rounded, so that a motion along them need not rest at the via points.

The curve has a parameter sigma (m), the way along the polyline. On the straight parts the derivative by it is the unit
vector of the leg. Within the blend radius r on either side of a via point it goes over from that of the leg before to
that of the leg after by a fifth-order step, d = d1 + (d2 - d1) S((sigma - sigma_0) / 2 r), whose integral is a
polynomial. So three derivatives are continuous, which leaves torque and jerk continuous along the reference; and the
curve stays in the triangle of the via point and the two points at r from it, so within r of the via point. The
platform is slower in a corner than on the legs, at its middle by the cosine of half the turn.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import NamedTuple

from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.refusal import PlanRefused, place
from fivebar_control.trajectory.time_scaling import TimeLaw, progress, rest_to_rest, time_fraction
from fivebar_description.settings import Setting

LEAST_RADIUS = 1e-3
"""Least blend radius (m), but for 0, a rest at the via point."""

SHARPEST = math.radians(150.0)
"""Largest turn (rad) that is rounded: the speed at its middle is a quarter of that on the legs, for a reversal 0."""

FITS = 1e-9
"""Length (m) by which two corners may overlap: rounding of radii that share a leg."""

RESTS = (0.0,)
"""Blend radii of a path with a rest at each waypoint."""


def blend_radius_problem(radii: float | Sequence[float]) -> str | None:
    """Return what is wrong with blend radii (m), None for nothing; whether they fit the path the planner knows."""
    listed = (radii,) if isinstance(radii, float | int) else radii
    if listed and all(math.isfinite(radius) and (radius == 0.0 or radius >= LEAST_RADIUS) for radius in listed):
        return None
    return f"expected 0 for a rest, or at least {LEAST_RADIUS:g} m"


BLEND_RADIUS = Setting(
    "Radius within which the path rounds the corner at each waypoint between the first and the last one, so that the"
    " platform need not rest there; 0 for a rest. One number for all, or one for each.",
    "m",
    check=blend_radius_problem,
)
"""How corners are rounded."""


def radii_at(radii: Sequence[float], count: int) -> tuple[float, ...]:
    """Return one blend radius (m) for each of `count` waypoints between the first and the last, from as many or one.

    Raises:
        PlanRefused: one of them is impossible, or there are more or fewer.
    """
    problem = blend_radius_problem(radii)
    if problem is not None:
        raise PlanRefused(f"blend_radius: {list(radii)}: {problem}")
    if len(radii) == 1:
        return (radii[0],) * count
    if len(radii) != count:
        raise PlanRefused(
            f"blend_radius: {len(radii)} given for {count} waypoints between the first and the last: expected one"
            " number or one for each"
        )
    return tuple(radii)


class RoundedPolyline(NamedTuple):
    """A polyline with rounded corners.

    Attributes:
        points: start, via points and end (m).
        radii: blend radius at each of them (m), 0 at the first and the last one.
        ways: sigma at each of them (m).
    """

    points: tuple[tuple[float, float], ...]
    radii: tuple[float, ...]
    ways: tuple[float, ...]

    @classmethod
    def through(cls, points: Sequence[tuple[float, float]], radii: Sequence[float]) -> RoundedPolyline:
        """Return the curve from the first point to the last one (m), with a radius (m) for each one between them."""
        ways = accumulate((math.dist(*pair) for pair in pairwise(points)), initial=0.0)
        return cls(tuple((x, y) for x, y in points), (0.0, *radii, 0.0), tuple(ways))

    @property
    def legs(self) -> int:
        """Number of legs."""
        return len(self.points) - 1

    @property
    def length(self) -> float:
        """The way along the polyline (m)."""
        return self.ways[-1]

    def corners(self) -> tuple[tuple[float, float], ...]:
        """Return where each corner begins and ends, as shares of the way."""
        inside = zip(self.ways[1:-1], self.radii[1:-1], strict=True)
        return tuple(((way - r) / self.length, (way + r) / self.length) for way, r in inside)

    def at(self, s: float) -> tuple[float, float, float, float, float, float]:
        """Return the place (m) at a share s of the way, with its first and second derivative by s (m)."""
        length = self.length
        way = min(max(s, 0.0), 1.0) * length
        leg = 0
        while leg + 2 < len(self.ways) and way >= self.ways[leg + 1]:
            leg += 1
        if way - self.ways[leg] < self.radii[leg]:
            return self._in_corner(leg, way)
        if self.ways[leg + 1] - way < self.radii[leg + 1]:
            return self._in_corner(leg + 1, way)
        (x, y), (d_x, d_y) = self.points[leg], self.direction(leg)
        along = way - self.ways[leg]
        return x + d_x * along, y + d_y * along, d_x * length, d_y * length, 0.0, 0.0

    def direction(self, leg: int) -> tuple[float, float]:
        """Return the unit vector of a leg, of which 0 is the first."""
        (x0, y0), (x1, y1) = self.points[leg], self.points[leg + 1]
        distance = math.hypot(x1 - x0, y1 - y0)
        return (x1 - x0) / distance, (y1 - y0) / distance

    def turn(self, corner: int) -> float:
        """Return the angle (rad, positive) by which the direction turns at a point between the first and the last."""
        (a_x, a_y), (b_x, b_y) = self.direction(corner - 1), self.direction(corner)
        return abs(math.atan2(a_x * b_y - a_y * b_x, a_x * b_x + a_y * b_y))

    def _in_corner(self, corner: int, way: float) -> tuple[float, float, float, float, float, float]:
        radius, length = self.radii[corner], self.length
        (x, y), (a_x, a_y), (b_x, b_y) = self.points[corner], self.direction(corner - 1), self.direction(corner)
        u = (way - self.ways[corner] + radius) / (2.0 * radius)
        step, slope, _ = rest_to_rest(u)
        gone = u * u * u * u * (2.5 + u * (u - 3.0))
        bend = slope * length * length / (2.0 * radius)
        return (
            x - radius * a_x + 2.0 * radius * (a_x * u + (b_x - a_x) * gone),
            y - radius * a_y + 2.0 * radius * (a_y * u + (b_y - a_y) * gone),
            (a_x + (b_x - a_x) * step) * length,
            (a_y + (b_y - a_y) * step) * length,
            (b_x - a_x) * bend,
            (b_y - a_y) * bend,
        )


class RoundedSegment(NamedTuple):
    """One motion from rest to rest along a rounded polyline: start time and duration (s), and how time passes."""

    curve: RoundedPolyline
    start_time: float
    duration: float
    time_law: TimeLaw = rest_to_rest

    def at(self, t: float) -> Platform:
        """Return the reference at time t (s); before and after the segment the platform rests at its ends."""
        return self.moved(*progress(self.time_law, t - self.start_time, self.duration))

    def moved(self, s: float, ds: float, dds: float) -> Platform:
        """Return the platform at a share of the way, given its two derivatives by time (1/s, 1/s^2)."""
        x, y, d_x, d_y, b_x, b_y = self.curve.at(s)
        return Platform(x, y, d_x * ds, d_y * ds, d_x * dds + b_x * ds * ds, d_y * dds + b_y * ds * ds)

    def time_at(self, s: float) -> float:
        """Return when the platform has gone a share of the way (s)."""
        return self.start_time + time_fraction(self.time_law, s) * self.duration

    def line_at(self, t: float) -> Line:
        """Return the tangent at time t (s)."""
        x, y, d_x, d_y, _, _ = self.curve.at(self.time_law((t - self.start_time) / self.duration)[0])
        rate = math.hypot(d_x, d_y)
        return Line(x, y, d_x / rate, d_y / rate)


def stretches(
    waypoints: Sequence[tuple[float, float]], durations: Sequence[float], radii: Sequence[float]
) -> list[RoundedSegment | None]:
    """Return the segments between rests: one for several legs that are joined by corners, None for a single leg.

    Args:
        waypoints: m.
        durations: of the legs (s); those of joined legs are added.
        radii: at each waypoint between the first and the last one (m), 0 for a rest.

    Raises:
        PlanRefused: a corner is too sharp, or two corners do not fit on the leg between them.
    """
    segments: list[RoundedSegment | None] = []
    first, time = 0, 0.0
    for last in range(1, len(waypoints)):
        if last < len(waypoints) - 1 and radii[last - 1] != 0.0:
            continue
        duration = sum(durations[first:last])
        if last == first + 1:
            segments.append(None)
        else:
            curve = RoundedPolyline.through(waypoints[first : last + 1], radii[first : last - 1])
            _refuse_misfit(curve, first)
            segments.append(RoundedSegment(curve, time, duration))
        first, time = last, time + duration
    return segments


def _refuse_misfit(curve: RoundedPolyline, first: int) -> None:
    for corner in range(1, len(curve.points) - 1):
        if curve.turn(corner) > SHARPEST:
            raise PlanRefused(
                f"waypoint {first + corner + 1}: the corner at {place(*curve.points[corner])} turns by"
                f" {math.degrees(curve.turn(corner)):.0f} degrees: expected at most {math.degrees(SHARPEST):.0f}, or"
                " blend_radius 0 for a rest there"
            )
    for leg, (a, b) in enumerate(pairwise(curve.radii)):
        room = curve.ways[leg + 1] - curve.ways[leg]
        if a + b > room + FITS:
            raise PlanRefused(
                f"waypoints {first + leg + 1} and {first + leg + 2}: blend radii of {a:g} and {b:g} m do not fit on the"
                f" {room:.4g} m between them, {place(*curve.points[leg])} and {place(*curve.points[leg + 1])}: expected"
                f" smaller ones, at most {room:.4g} m together, or waypoints further apart"
            )
