# SPDX-License-Identifier: Apache-2.0
"""Plans a motion on request: from one rest to another, in either assembly mode of one working mode.

The straight line is tried first. Where it cannot be made, or crosses the Type 2 locus more often than needed, the way
comes from the map of the working mode: the shortest one, its gates chosen along the whole locus, its corners cut where
that is feasible. Where forces act all the time the straight line may be bent instead, if that is quicker.
Every segment is timed between two bounds, the motors' and the locus'; the whole is judged again.
Where via points are given the motion goes straight from one to the next, at rest in them or round the corner.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from fivebar_control.planning.alternative_courses import TimedCourse, chart_for
from fivebar_control.planning.bent_courses import bent_courses
from fivebar_control.planning.course import Course
from fivebar_control.planning.figures import Feasibility
from fivebar_control.planning.line_of_sight import Point, look_along
from fivebar_control.planning.pacing import NoPace, Task, slowest_pace
from fivebar_control.planning.postures import assembly_problem, mode_name, place_at, rest_problem
from fivebar_control.planning.roadmap import JOIN_REACH, Gate, Way
from fivebar_control.planning.timing import DurationSearch, Speed, Timed, courses_for, quickest
from fivebar_control.planning.via_points import along
from fivebar_control.trajectory.planner import Crossing, Plan, PlanRefused
from fivebar_control.trajectory.refusal import place
from fivebar_control.trajectory.rounded import RESTS, radii_at

SAME_PLACE = 1e-6
"""Distance (m) below which two rests are the same."""

ATTEMPTS = 6
"""Ways on the map that are tried."""


class TransferRefused(PlanRefused):
    """There is no feasible motion; the message gives the reason."""


class Transfer(NamedTuple):
    """A feasible motion between two rests.

    Attributes:
        plan: the checked motion.
        feasibility: its figures, all within their limits.
        course: where it goes.
        durations: of the legs of its course (s).
        assembly_start, assembly_goal: signs of det A.
    """

    plan: Plan
    feasibility: Feasibility
    course: Course
    durations: tuple[float, ...]
    assembly_start: int
    assembly_goal: int

    @property
    def crossings(self) -> tuple[Crossing, ...]:
        """Its crossings of the Type 2 locus."""
        return self.plan.crossings

    def speed_at(self, crossing: Crossing) -> float:
        """Return the speed (m/s) of the platform at a crossing."""
        motion = self.plan.path.at(crossing.time)
        return math.hypot(motion.vx, motion.vy)

    @property
    def waypoints(self) -> tuple[Point, ...]:
        """Points along it (m), start and goal included: rests, unless the course rounds the corner there."""
        return self.course.waypoints


def plan_transfer(
    task: Task,
    start: Point,
    goal: Point,
    assembly: int | None = None,
    duration: float | Speed = Speed.COMFORTABLE,
    via: Sequence[Point] = (),
    blend_radius: Sequence[float] = RESTS,
) -> Transfer:
    """Plan a motion from a rest at `start` to one at `goal` (m) in an assembly mode, the sign of det A.

    Args:
        task: the conditions that the motion is planned for.
        start: where it rests now.
        goal: where it shall rest.
        assembly: +1, -1, or None for the one that the goal has in the working mode.
        duration: of the whole motion (s), or how to choose it.
        via: points (m) on the way, straight lines between them.
        blend_radius: within which each corner there is rounded (m), 0 for a rest; one for all, or one for each.

    Raises:
        TransferRefused: there is no feasible motion, or none was found.
    """
    robot, working_mode, limits = task.robot, task.working_mode, task.limits
    for name, point in (("start", start), ("goal", goal)):
        problem = rest_problem(robot, working_mode, *point, limits)
        if problem is not None:
            near = name == "start" and place_at(robot, working_mode, *point).kappa < limits.rest
            raise TransferRefused(f"{name}: {problem}{'; `fivebar posture` shows the way out' if near else ''}")
    if assembly is not None:
        problem = assembly_problem(robot, working_mode, *goal, assembly, limits)
        if problem is not None:
            raise TransferRefused(f"goal: {problem}")
    points = (start, *via, goal)
    for number, (before, after) in enumerate(pairwise(points), start=1):
        if math.dist(before, after) < SAME_PLACE:
            which, is_ = ("goal", "rests") if number > len(via) else (f"via point {number}", "is")
            raise TransferRefused(f"{which}: the platform {is_} at {place(*after)} already")
    signs = [place_at(robot, working_mode, *point).assembly for point in (start, goal)]
    if not via and any(blend_radius):
        raise TransferRefused(
            f"blend_radius: {list(blend_radius)}: expected with via points, whose corners are rounded"
        )
    if via:
        course = Course.through(points, radii_at(blend_radius, len(via))).for_robot(robot)
        motion = _given(task, course, duration)
    else:
        search = _Search(task, start, goal, duration)
        motion = search.found(needed=0 if signs[0] == signs[1] else 1)
    return Transfer(motion.plan, motion.feasibility, motion.course, motion.durations, signs[0], signs[1])


def transfer_along(task: Task, timed: TimedCourse) -> Transfer:
    """Return the motion along a course in the given durations of its legs, by its own time law.

    Raises:
        TransferRefused: it is not feasible.
    """
    course, durations = timed
    signs = [place_at(task.robot, task.working_mode, *course.waypoints[end]).assembly for end in (0, -1)]
    plan = task.plan(course, durations)
    feasibility = task.judge_run(plan)
    if not feasibility.feasible:
        raise TransferRefused("; ".join(feasibility.reasons))
    return Transfer(plan, feasibility, course, durations, signs[0], signs[1])


def _given(task: Task, course: Course, duration: float | Speed) -> Timed:
    """Return the motion along a course that is given."""
    motion = along(task, course, duration)
    if isinstance(motion, Timed):
        return motion
    start, *via, goal = (place(*point) for point in course.waypoints)
    raise TransferRefused(
        f"no feasible motion from {start} to {goal} in working mode {mode_name(task.working_mode)} by way of"
        f" {', '.join(via)}: {motion}"
    )


class _Search:
    """Looks for a feasible motion. Where something is not feasible its methods return the reason, a text."""

    def __init__(self, task: Task, start: Point, goal: Point, duration: float | Speed) -> None:
        self._task, self._start, self._goal, self._duration = task, start, goal, duration
        self._durations = DurationSearch(task, duration)
        self._slowest: dict[Course, Plan | NoPace] = {}

    def found(self, needed: int) -> Timed:
        """Return the motion: the straight line where it crosses no more often than needed, else the best way known."""
        straight = self._timed((self._start, self._goal))
        slowest = self._pass(self._start, self._goal)
        if not isinstance(slowest, NoPace) and len(slowest.crossings) <= needed:
            if isinstance(straight, Timed):
                return straight
            if not isinstance(self._duration, Speed):
                # it is the duration that is not possible
                raise TransferRefused(straight)
        bent = bent_courses(self._task, self._start, self._goal)
        otherwise = quickest([self._by_map(), *(along(self._task, course, self._duration) for course in bent)])
        for candidate in (otherwise, straight):
            if isinstance(candidate, Timed):
                return candidate
        raise TransferRefused(
            f"no feasible motion from {place(*self._start)} to {place(*self._goal)} in working mode"
            f" {mode_name(self._task.working_mode)}; in a straight line: {straight}; by other ways: {otherwise}"
        )

    def _by_map(self) -> Timed | str:
        """Try the ways on the map, the shortest first, until one is feasible."""
        chart = chart_for(self._task)
        for name, point in (("start", self._start), ("goal", self._goal)):
            if not chart.reaches(point):
                return f"the {name} cannot be left by a line of {JOIN_REACH * 1e3:.0f} mm that keeps the limits"
        barred: frozenset[Gate] = frozenset()
        reason = "the locus parts start and goal, and no gate through it keeps the limits"
        for _ in range(ATTEMPTS):
            way = chart.way(self._start, self._goal, barred)
            if way is None:
                return reason
            shut = [gate for gate in way.gates if isinstance(self._pass(*gate), NoPace)]
            if shut:
                # rather than to find the others one way at a time
                passes = {gate: self._pass(*gate) for gate in chart.gates}
                reason += f", as {passes[shut[0]]}" if not barred else ""
                shut = [gate for gate, pace in passes.items() if isinstance(pace, NoPace)]
            else:
                timed = self._timed(self._straightened(way))
                if isinstance(timed, Timed) or not way.gates:
                    return timed
                reason, shut = timed, [way.gates[0]]
            barred |= frozenset(shut)
        return reason

    def _straightened(self, way: Way) -> tuple[Point, ...]:
        """Cut the corners of a way wherever that is feasible and needs no further crossing."""
        gates = {frozenset(gate) for gate in way.gates}
        crossed = [0]
        for pair in pairwise(way.points):
            crossed.append(crossed[-1] + (frozenset(pair) in gates))
        points, at = [way.points[0]], 0
        while at + 1 < len(way.points):
            at = next(
                later
                for later in range(len(way.points) - 1, at, -1)
                if later == at + 1 or self._passes(way.points[at], way.points[later], crossed[later] - crossed[at])
            )
            points.append(way.points[at])
        return tuple(points)

    def _passes(self, start: Point, end: Point, crossings: int) -> bool:
        limits = self._task.limits
        sight = look_along(self._task.robot, self._task.working_mode, start, end, limits.serial_margin, limits.rest)
        return sight.clear and sight.crossings <= crossings and not isinstance(self._pass(start, end), NoPace)

    def _pass(self, start: Point, end: Point) -> Plan | NoPace:
        """Return the slowest feasible motion along a segment."""
        return self._slowest_along(Course((start, end)).for_robot(self._task.robot))

    def _slowest_along(self, part: Course) -> Plan | NoPace:
        known = self._slowest.get(part)
        if known is None:
            known = self._slowest[part] = slowest_pace(self._task, part)
        return known

    def _timed(self, waypoints: tuple[Point, ...]) -> Timed | str:
        """Choose the durations along straight segments."""
        course = Course.through(waypoints).for_robot(self._task.robot)
        return quickest([self._timed_along(variant) for variant in courses_for(course, self._duration)])

    def _timed_along(self, course: Course) -> Timed | str:
        slowest = []
        for part in course.between_rests():
            pace = self._slowest_along(part)
            if isinstance(pace, NoPace):
                return pace.reason
            slowest.append(pace)
        return self._durations.timed(course, slowest)
