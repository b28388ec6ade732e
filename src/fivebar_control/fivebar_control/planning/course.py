# SPDX-License-Identifier: Apache-2.0
"""Where a requested motion goes: waypoints, with rests or rounded corners at those in between."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import accumulate, pairwise
from typing import NamedTuple

from fivebar_control.planning.line_of_sight import Point
from fivebar_control.trajectory.time_laws import CRITERION, OPTIMAL, OPTIMAL_WITH_FRICTION, QUINTIC, SEPTIC
from fivebar_description.parameters import FiveBar, has_external_force

STRAIGHT_LAWS = (QUINTIC, OPTIMAL)
"""The time laws that the planner knows for straight parts between rests, the smoother one first."""

OTHER_LAWS = (SEPTIC, CRITERION, QUINTIC, OPTIMAL, OPTIMAL_WITH_FRICTION)
"""All time laws of straight parts, as they are tried for better odds."""


class Course(NamedTuple):
    """Where a motion goes.

    Attributes:
        waypoints: start, via points and goal (m).
        blend_radius: at each between the first and the last (m), 0 for a rest.
        time_law: of the planner, by which it is passed.
    """

    waypoints: tuple[Point, ...]
    blend_radius: tuple[float, ...] = ()
    time_law: str = QUINTIC

    @classmethod
    def through(cls, waypoints: Sequence[Point], blend_radius: Sequence[float] = ()) -> Course:
        """Return the course through waypoints, at rest in each unless a radius (m) says otherwise.

        A polynomial over several legs is quickest about its middle, where the corner may be; what is rounded is passed
        with the least torque, which slows down for a corner and meets the dynamic criterion at every crossing.
        """
        radii = tuple(blend_radius) or (0.0,) * (len(waypoints) - 2)
        return cls(tuple(waypoints), radii, OPTIMAL if any(radii) else QUINTIC)

    def for_robot(self, robot: FiveBar) -> Course:
        """Return the course with the time law that gravity in the plane or a constant force needs, if there is any."""
        return self._replace(time_law=CRITERION) if has_external_force(robot) else self

    @property
    def rounded(self) -> bool:
        """Whether it rounds a corner."""
        return any(self.blend_radius)

    def between_rests(self) -> list[Course]:
        """Return its parts from one rest to the next."""
        rests = [0, *(number for number, radius in enumerate(self.blend_radius, 1) if radius == 0.0)]
        ends = [*rests[1:], len(self.waypoints) - 1]
        return [
            Course(self.waypoints[first : last + 1], self.blend_radius[first : last - 1], self.time_law)
            for first, last in zip(rests, ends, strict=True)
        ]

    def by_each_law(self) -> list[Course]:
        """Return the course with each time law that the planner knows for it.

        Round corners that is its own only, and so where the robot's forces ask for one.
        """
        if self.rounded or self.time_law not in STRAIGHT_LAWS:
            return [self]
        return [self._replace(time_law=law) for law in STRAIGHT_LAWS]

    def by_other_laws(self, robot: FiveBar) -> list[Course]:
        """Return the course with each other time law that a robot can follow: none where corners or forces need one."""
        if self.rounded or has_external_force(robot):
            return []
        return [self._replace(time_law=law) for law in OTHER_LAWS if law != self.time_law]

    def shared(self, duration: float) -> tuple[float, ...]:
        """Return the parts of a duration (s) that its legs have by their lengths."""
        lengths = [math.dist(*pair) for pair in pairwise(self.waypoints)]
        return tuple(duration * (length / sum(lengths)) for length in lengths)

    def sampled(self, duration: float, rate_hz: int) -> tuple[float, ...]:
        """Return the parts of a duration (s), a whole number of samples, each a whole number of them too."""
        if len(self.waypoints) == 2:
            return (duration,)
        ends = [round(end * rate_hz) for end in accumulate(self.shared(duration))]
        samples = [max(1, after - before) for before, after in pairwise([0, *ends])]
        # what short legs have been given is taken from the longest one
        samples[samples.index(max(samples))] += round(duration * rate_hz) - sum(samples)
        return tuple(number / rate_hz for number in samples)


NO_COURSE = Course(())
"""The course of a refused request, and of a step that moves nothing."""
