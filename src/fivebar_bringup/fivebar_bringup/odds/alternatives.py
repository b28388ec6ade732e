# SPDX-License-Identifier: Apache-2.0
"""Alternatives of a motion: another duration, another time law, or another place of crossing."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Generic, NamedTuple, TypeVar

from fivebar_bringup.odds.choice import Choice, likeliest
from fivebar_bringup.odds.robot_errors import RobotErrors
from fivebar_bringup.odds.trials import LAST_ROBOTS
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.alternative_courses import TimedCourse
from fivebar_control.planning.course import Course
from fivebar_control.trajectory.refusal import place

M = TypeVar("M")


class Candidate(NamedTuple, Generic[M]):
    """A planned motion, and the scenario by which it is run."""

    motion: M
    scenario: Scenario

    @property
    def duration(self) -> float:
        """How long it takes (s)."""
        return sum(self.scenario.durations())

    @property
    def timed(self) -> TimedCourse:
        """Where it goes, and how long its legs take."""
        scenario = self.scenario
        radius = scenario.blend_radius
        radii = radius if isinstance(radius, tuple) else (radius,) * (len(scenario.waypoints) - 2)
        return TimedCourse(Course(scenario.waypoints, radii, scenario.time_law), scenario.durations())

    def how_other_than(self, first: Candidate[M]) -> str:
        """Return in what else than its duration it differs from another motion, in words; "" for nothing."""
        ours, theirs = self.timed.course, first.timed.course
        law = f" by time law {ours.time_law}" if ours.time_law != theirs.time_law else ""
        if ours.waypoints == theirs.waypoints:
            return law
        return f"{law} by way of {' and '.join(place(*point) for point in ours.waypoints[1:-1])}"


class Alternatives(NamedTuple, Generic[M]):
    """Alternatives of a motion.

    Attributes:
        planned: returns the motion along a course in given durations, None where it is not feasible.
        other_laws: returns a course by each further time law.
        elsewhere: yields courses through other places of the locus, where the goal leaves them open and time allows.
        rate_hz: of the controllers.
    """

    planned: Callable[[TimedCourse], Candidate[M] | None]
    other_laws: Callable[[Course], Sequence[Course]]
    elsewhere: Callable[[], Iterable[TimedCourse]]
    rate_hz: int

    def in_duration(self, of: Candidate[M], duration: float) -> Candidate[M] | None:
        """Return a motion in another duration (s), by its own time law or by the first other one that can be."""
        course, durations = of.timed
        scaled = tuple(max(1, round(one * duration / of.duration * self.rate_hz)) / self.rate_hz for one in durations)
        for one in (course, *(other for other in course.by_each_law() if other != course)):
            found = self.planned(TimedCourse(one, scaled))
            if found is not None:
                return found
        return None

    def beside(self, motion: Candidate[M], until: float) -> Iterator[Candidate[M]]:
        """Yield a motion by other time laws, and those through other places, as far as feasible and in time."""
        for one in self._courses_beside(motion.timed):
            if time.monotonic() >= until:
                return
            found = self.planned(one)
            if found is not None:
                yield found

    def _courses_beside(self, timed: TimedCourse) -> Iterator[TimedCourse]:
        """Yield a course by other time laws, then others through other places, each when it is asked for."""
        for law in self.other_laws(timed.course):
            yield TimedCourse(law, timed.durations)
        yield from self.elsewhere()


def best_of_all(
    motions: Sequence[Candidate[M]],
    alternatives: Alternatives[M],
    errors: RobotErrors,
    seed: int,
    required: float,
    until: float = math.inf,
) -> Choice[Candidate[M]] | None:
    """Return the likeliest of some motions, and where it is not likely enough, of what it might be instead.

    None of no motions, or for want of time. Another law or place that is chosen is tried on `LAST_ROBOTS`: those before
    have decided that others are tried at all.

    Args:
        motions: in several durations.
        alternatives: by which others are found.
        errors, seed: of the drawn robots.
        required: share of the robots that has to make it.
        until: when no further motion is planned and no further robot tried (s on the steady clock).
    """
    choice = likeliest(motions, lambda one: one.scenario, errors, seed, until)
    if choice is None or choice.odds.share >= required:
        return choice
    others = list(alternatives.beside(choice.motion, until))
    if not others:
        return choice
    found = likeliest([choice.motion, *others], lambda one: one.scenario, errors, seed, until, LAST_ROBOTS)
    # the same motion does not get a second chance
    return choice if found is None or found.motion is choice.motion else found
