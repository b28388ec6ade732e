# SPDX-License-Identifier: Apache-2.0
"""Alternatives of a motion: another duration, another time law, or another place of crossing."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Generic, NamedTuple

from fivebar_bringup.odds.choice import Choice, likeliest
from fivebar_bringup.odds.planned_motion import M, PlannedMotion
from fivebar_bringup.odds.robot_errors import RobotErrors
from fivebar_bringup.odds.trials import DECIDING_ROBOTS, LAST_ROBOTS, trials_of
from fivebar_control.compiling import expect_many_motions
from fivebar_control.planning.alternative_courses import TimedCourse
from fivebar_control.planning.course import Course
from fivebar_description.stages import stage


class Alternatives(NamedTuple, Generic[M]):
    """Alternatives of a motion.

    Attributes:
        planned: returns the motion along a course in given durations, None where it is not feasible.
        other_laws: returns a course by each further time law.
        elsewhere: yields courses through other places of the locus, where the goal leaves them open and time allows.
        rate_hz: of the controllers.
    """

    planned: Callable[[TimedCourse], PlannedMotion[M] | None]
    other_laws: Callable[[Course], Sequence[Course]]
    elsewhere: Callable[[], Iterable[TimedCourse]]
    rate_hz: int

    def in_duration(self, of: PlannedMotion[M], duration: float) -> PlannedMotion[M] | None:
        """Return a motion in another duration (s), by its own time law or by the first other one that can be."""
        course, durations = of.timed
        scaled = tuple(max(1, round(leg * duration / of.duration * self.rate_hz)) / self.rate_hz for leg in durations)
        for by_law in (course, *(other for other in course.by_each_law() if other != course)):
            motion = self.planned(TimedCourse(by_law, scaled))
            if motion is not None:
                return motion
        return None

    def in_durations(
        self, of: PlannedMotion[M], durations: Iterable[float], until: float = math.inf
    ) -> Iterator[PlannedMotion[M]]:
        """Yield a motion in other durations (s), as far as it is feasible and there is time."""
        for duration in durations:
            if time.monotonic() >= until:
                return
            motion = self.in_duration(of, duration)
            if motion is not None:
                yield motion

    def beside(self, motion: PlannedMotion[M], until: float) -> Iterator[PlannedMotion[M]]:
        """Yield a motion by other time laws, and those through other places, as far as feasible and in time."""
        for course in self._courses_beside(motion.timed):
            if time.monotonic() >= until:
                return
            alternative = self.planned(course)
            if alternative is not None:
                yield alternative

    def _courses_beside(self, timed: TimedCourse) -> Iterator[TimedCourse]:
        """Yield a course by other time laws, then others through other places, each when it is asked for."""
        for law in self.other_laws(timed.course):
            yield TimedCourse(law, timed.durations)
        yield from self.elsewhere()


def best_of_all(
    motions: Sequence[PlannedMotion[M]],
    alternatives: Alternatives[M],
    errors: RobotErrors,
    seed: int,
    required: float,
    until: float = math.inf,
) -> Choice[M] | None:
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
    choice = likeliest(motions, errors, seed, until)
    if choice is None or choice.odds.share >= required:
        return choice
    beside = list(alternatives.beside(choice.motion, until))
    if not beside:
        return choice
    last = likeliest([choice.motion, *beside], errors, seed, until, LAST_ROBOTS)
    # the same motion does not get a second chance
    return choice if last is None or last.motion is choice.motion else last


def first_or_best(
    first: PlannedMotion[M],
    in_other_durations: Iterable[PlannedMotion[M]],
    alternatives: Alternatives[M],
    errors: RobotErrors,
    seed: int,
    until: float = math.inf,
    failures: float = math.inf,
) -> Choice[M]:
    """Return a motion where it is likely enough, or not known to be unlikely when the time is over, else the best one.

    Where nothing else can be tried it is the first one, too, with what is known of its odds.

    Args:
        first: on `DECIDING_ROBOTS`.
        in_other_durations: what is tried first instead, each planned when it is asked for.
        alternatives, errors, seed, until: as for `best_of_all`.
        failures: with more of them the first motion is tried no further.
    """
    with stage("trying drawn robots"):
        odds, _, failed = trials_of(first.scenario, errors, seed, DECIDING_ROBOTS, until, failures)
    choice = Choice(first, odds, DECIDING_ROBOTS, failed)
    if choice.likely:
        return choice
    expect_many_motions()
    with stage("trying other durations, time laws and ways"):
        return best_of_all([*in_other_durations], alternatives, errors, seed, first.required, until) or choice
