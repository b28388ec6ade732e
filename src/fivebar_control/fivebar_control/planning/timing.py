# SPDX-License-Identifier: Apache-2.0
"""How long the parts of a requested motion take, from rest to rest, so that the whole is feasible."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from itertools import chain
from typing import NamedTuple

from fivebar_control.planning.course import Course
from fivebar_control.planning.figures import Feasibility, first_feasible, nearest
from fivebar_control.planning.pacing import Pace, Task, pace_of
from fivebar_control.trajectory.planner import Plan, PlanRefused

SLOWER = (1.0, 1.4, 2.0, 2.8, 4.0)
"""Factors on the durations that are tried, where segments that are feasible each are not so together."""

QUICKER_OR_SLOWER = (1.0, 0.7, 0.5, *SLOWER[1:])
"""The same for a robot with tolerances: the shorter the time near the locus, the less an estimate drifts there."""

UNHURRIED = 1.4
"""Factor on the duration of a crossing under declared loads, where the platform is expected no farther off with it."""


class Speed(StrEnum):
    """How long a transfer takes: with room to all limits, or as short as they allow."""

    COMFORTABLE = "comfortable"
    FASTEST = "fastest"


class Timed(NamedTuple):
    """A feasible motion.

    Attributes:
        plan: the checked motion.
        feasibility: its figures.
        course: where it goes.
        durations: of the legs of its course (s).
    """

    plan: Plan
    feasibility: Feasibility
    course: Course
    durations: tuple[float, ...]


def courses_for(course: Course, duration: float | Speed) -> list[Course]:
    """Return a course by each time law to time it by: its own, for the fastest motion all."""
    return course.by_each_law() if duration is Speed.FASTEST else [course]


def quickest(motions: Sequence[Timed | str]) -> Timed | str:
    """Return the quickest of motions along the same way, or the reason against the first where there is none."""
    timed = [motion for motion in motions if isinstance(motion, Timed)]
    return min(timed, key=lambda motion: sum(motion.durations)) if timed else motions[0]


class DurationSearch:
    """Chooses durations. Where something is not feasible its methods return the reason, a text."""

    def __init__(self, task: Task, duration: float | Speed) -> None:
        """Bind the task, and the duration of whole motions (s), or how to choose it."""
        self._task, self._duration = task, duration
        self._advised = False

    def timed(self, course: Course, slowest: Sequence[Plan]) -> Timed | str:
        """Choose the durations along a course, given the slowest feasible plan of each part from rest to rest."""
        task = self._task
        parts = course.between_rests()
        paces = [pace_of(task, plan) for plan in slowest]
        motion = first_feasible(
            self._durations(paces),
            lambda chosen: self._by_each_law(course, self._shared(parts, chosen)),
            lambda chosen: self._unhurried(course, chosen, slowest),
        )
        if isinstance(self._duration, Speed) or not isinstance(motion, str):
            return motion
        shortest, longest = sum(pace.fastest for pace in paces), sum(pace.slowest for pace in paces)
        return f"in {self._duration:g} s {motion} (possible are about {shortest:.2f} to {longest:.2f} s)"

    def _by_each_law(self, course: Course, durations: tuple[float, ...], advised: bool = True) -> Timed | str:
        """Return the motion in the given durations (s) of its legs, under declared loads by the best time law."""
        motions: list[Timed] = []
        reason = ""
        for variant in course.by_each_law() if self._task.limits.loads.declared else [course]:
            tried = self._tried(variant, durations, advised)
            if isinstance(tried, str):
                reason = reason or tried
                continue
            motions.append(tried)
            if not tried.plan.crossings:
                break
        return nearest(motions) if motions else reason

    def _unhurried(self, course: Course, chosen: tuple[float, ...], slowest: Sequence[Plan]) -> Timed | str | None:
        """Return the motion in longer durations (s) of its parts, where loads may have made a crossing quick.

        None without declared loads, and where the durations are not the planner's to choose.
        """
        if self._duration is not Speed.COMFORTABLE or not self._task.limits.loads.declared:
            return None
        longer = tuple(
            self._whole(min(UNHURRIED * duration, plan.path.duration)) if plan.crossings else duration
            for duration, plan in zip(chosen, slowest, strict=True)
        )
        if longer == chosen:
            return None
        return self._by_each_law(course, self._shared(course.between_rests(), longer), advised=False)

    def _whole(self, duration: float) -> float:
        """Return a duration (s) as a whole number of samples, at least as long."""
        return math.ceil(duration * self._task.rate_hz - 1e-6) / self._task.rate_hz

    def _shared(self, parts: Sequence[Course], durations: Sequence[float]) -> tuple[float, ...]:
        """Return the durations (s) of the legs of the parts between rests, given those of the parts."""
        shared = (part.sampled(duration, self._task.rate_hz) for part, duration in zip(parts, durations, strict=True))
        return tuple(chain.from_iterable(shared))

    def _tried(self, course: Course, durations: tuple[float, ...], advised: bool) -> Timed | str:
        """Return the motion along a course in the given durations (s) of its legs, or why it is not feasible."""
        try:
            plan = self._task.plan(course, durations)
        except PlanRefused as refusal:
            return str(refusal)
        feasibility = self._task.judge_run(plan)
        if feasibility.feasible:
            return Timed(plan, feasibility, course, durations)
        return "; ".join(feasibility.reasons) + (self._advice(plan, feasibility) if advised else "")

    def _advice(self, plan: Plan, verdict: Feasibility) -> str:
        """Return what would make a motion feasible that the robot's tolerances forbid: once, as it takes long.

        A higher speed is no advice: the search tries these itself.
        """
        if self._advised:
            return ""
        suggestion = self._task.advice(plan, verdict)
        self._advised = bool(suggestion)
        return f"; within the limits with {suggestion}" if suggestion else ""

    def _durations(self, paces: Sequence[Pace]) -> list[tuple[float, ...]]:
        """Return the durations of the parts to try, whole numbers of samples."""
        rate_hz = self._task.rate_hz
        if self._duration is Speed.FASTEST:
            chosen = [pace.fastest for pace in paces]
        else:
            chosen = [pace.comfortable for pace in paces]
        if not isinstance(self._duration, Speed):
            share = self._duration / sum(chosen)
            return [tuple(max(1, round(duration * share * rate_hz)) / rate_hz for duration in chosen)]
        sensing = self._task.sensing
        factors = QUICKER_OR_SLOWER if sensing is not None and sensing.declared else SLOWER
        return [
            tuple(
                self._whole(min(max(duration * factor, pace.fastest), pace.slowest))
                for duration, pace in zip(chosen, paces, strict=True)
            )
            for factor in factors
        ]
