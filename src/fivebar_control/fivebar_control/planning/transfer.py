"""Plans a motion on request: from one rest to another, in either assembly mode of one working mode.

The straight line is tried first. Where it cannot be made, or crosses the Type 2 locus more often than needed, the way
comes from the map of the working mode: the shortest one, its gates chosen along the whole locus, its corners cut where
that is feasible. Every segment is timed between two bounds, the motors' and the locus'; the whole is judged again.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from itertools import pairwise
from typing import NamedTuple

from fivebar_control.laws.registry import CONTROLLERS, TunedController, default_tuning
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.planning.feasibility import Feasibility
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.pacing import NoPace, Pace, Task, pace_of, slowest_pace
from fivebar_control.planning.postures import (
    assembly_problem,
    mode_name,
    place_at,
    rest_problem,
)
from fivebar_control.planning.predicted_estimate import Sensing
from fivebar_control.planning.roadmap import JOIN_REACH, Gate, Way, roadmap
from fivebar_control.planning.sight import Point, look_along
from fivebar_control.trajectory.planner import Crossing, Plan, PlanRefused
from fivebar_control.trajectory.refusal import place
from fivebar_description.parameters import FiveBar

DEFAULT_FOLLOWER, DEFAULT_LIMITS = default_tuning(CONTROLLERS["unified"]), MotionLimits()
"""The law without switching, within the limits as they come."""

SAME_PLACE = 1e-6
"""Distance (m) below which two rests are the same."""

SLOWER = (1.0, 1.4, 2.0, 2.8, 4.0)
"""Factors on the durations that are tried, where segments that are feasible each are not so together."""

QUICKER_OR_SLOWER = (1.0, 0.7, 0.5, *SLOWER[1:])
"""The same for a robot with tolerances: the shorter the time near the locus, the less an estimate drifts there."""

ATTEMPTS = 6
"""Ways on the map that are tried."""


class TransferRefused(PlanRefused):
    """There is no feasible motion; the message gives the reason."""


class Speed(StrEnum):
    """How long a transfer takes: with room to all limits, or as short as they allow."""

    COMFORTABLE = "comfortable"
    FASTEST = "fastest"


class Branch(NamedTuple):
    """A crossing, with the branch of the locus that it crosses.

    Attributes:
        crossing: as planned.
        shape: "stretched" or "folded": how the distal links lie on one line.
        speed: of the platform (m/s).
    """

    crossing: Crossing
    shape: str
    speed: float


class Transfer(NamedTuple):
    """A feasible motion between two rests.

    Attributes:
        plan: the checked motion.
        feasibility: its figures, all within their limits.
        waypoints: rests along it, start and goal included (m).
        durations: of its segments (s).
        assembly_start, assembly_goal: signs of det A.
        branches: its crossings of the Type 2 locus.
    """

    plan: Plan
    feasibility: Feasibility
    waypoints: tuple[Point, ...]
    durations: tuple[float, ...]
    assembly_start: int
    assembly_goal: int
    branches: tuple[Branch, ...]


def plan_transfer(
    robot: FiveBar,
    working_mode: tuple[int, int],
    start: Point,
    goal: Point,
    assembly: int | None,
    rate_hz: int,
    follower: TunedController = DEFAULT_FOLLOWER,
    limits: MotionLimits = DEFAULT_LIMITS,
    duration: float | Speed = Speed.COMFORTABLE,
    sensing: Sensing | None = None,
) -> Transfer:
    """Plan a motion from a rest at `start` to one at `goal` (m) in an assembly mode, the sign of det A.

    Args:
        robot: to be moved.
        working_mode: of the whole motion.
        start: where it rests now.
        goal: where it shall rest.
        assembly: +1, -1, or None for the one that the goal has in the working mode.
        rate_hz: of the controllers.
        follower: which controller is to follow.
        limits: what the motion has to keep.
        duration: of the whole motion (s), or how to choose it.
        sensing: what the estimator has, None without one.

    Raises:
        TransferRefused: there is no feasible motion, or none was found.
    """
    task = Task(robot, working_mode, rate_hz, follower, limits, sensing)
    for name, point in (("start", start), ("goal", goal)):
        problem = rest_problem(robot, working_mode, *point, limits)
        if problem is not None:
            near = name == "start" and place_at(robot, working_mode, *point).kappa < limits.rest
            raise TransferRefused(f"{name}: {problem}{'; `fivebar posture` shows the way out' if near else ''}")
    if assembly is not None:
        problem = assembly_problem(robot, working_mode, *goal, assembly, limits)
        if problem is not None:
            raise TransferRefused(f"goal: {problem}")
    if math.dist(start, goal) < SAME_PLACE:
        raise TransferRefused(f"goal: the platform rests at {place(*goal)} already")
    signs = [place_at(robot, working_mode, *point).assembly for point in (start, goal)]
    search = _Search(task, start, goal, duration)
    found = search.found(needed=0 if signs[0] == signs[1] else 1)
    branches = tuple(_branch(task, found.plan, crossing) for crossing in found.plan.crossings)
    return Transfer(found.plan, found.feasibility, found.waypoints, found.durations, signs[0], signs[1], branches)


class _Timed(NamedTuple):
    plan: Plan
    feasibility: Feasibility
    waypoints: tuple[Point, ...]
    durations: tuple[float, ...]


class _Search:
    """Looks for a feasible motion. Where something is not feasible its methods return the reason, a text."""

    def __init__(self, task: Task, start: Point, goal: Point, duration: float | Speed) -> None:
        self._task, self._start, self._goal, self._duration = task, start, goal, duration
        self._slowest: dict[tuple[Point, Point], Plan | NoPace] = {}
        self._advised = False

    def found(self, needed: int) -> _Timed:
        """Return the motion: the straight line where it crosses no more often than needed, else the best way known."""
        straight = self._timed((self._start, self._goal))
        slowest = self._pass(self._start, self._goal)
        if not isinstance(slowest, NoPace) and len(slowest.crossings) <= needed:
            if isinstance(straight, _Timed):
                return straight
            if not isinstance(self._duration, Speed):
                # it is the duration that is not possible
                raise TransferRefused(straight)
        by_map = self._by_map()
        for candidate in (by_map, straight):
            if isinstance(candidate, _Timed):
                return candidate
        raise TransferRefused(
            f"no feasible motion from {place(*self._start)} to {place(*self._goal)} in working mode"
            f" {mode_name(self._task.working_mode)}; in a straight line: {straight}; by other ways: {by_map}"
        )

    def _by_map(self) -> _Timed | str:
        """Try the ways on the map, the shortest first, until one is feasible."""
        limits = self._task.limits
        chart = roadmap(self._task.robot, self._task.working_mode, limits.serial_margin, limits.rest)
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
                shut = [gate for gate, found in passes.items() if isinstance(found, NoPace)]
            else:
                timed = self._timed(self._straightened(way))
                if isinstance(timed, _Timed) or not way.gates:
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
        known = self._slowest.get((start, end))
        if known is None:
            known = self._slowest[start, end] = slowest_pace(self._task, start, end)
        return known

    def _timed(self, waypoints: tuple[Point, ...]) -> _Timed | str:
        """Choose the durations along straight segments."""
        paces = []
        for start, end in pairwise(waypoints):
            slowest = self._pass(start, end)
            if isinstance(slowest, NoPace):
                return slowest.reason
            paces.append(pace_of(self._task, slowest))
        reason = ""
        for durations in self._durations(paces):
            try:
                plan = self._task.plan(waypoints, durations)
            except PlanRefused as refusal:
                reason = reason or str(refusal)
                continue
            feasibility = self._task.judge_run(plan)
            if feasibility.feasible:
                return _Timed(plan, feasibility, waypoints, durations)
            reason = reason or "; ".join(feasibility.reasons) + self._advice(plan, feasibility)
        if isinstance(self._duration, Speed):
            return reason
        shortest, longest = sum(pace.fastest for pace in paces), sum(pace.slowest for pace in paces)
        return f"in {self._duration:g} s {reason} (possible are about {shortest:.2f} to {longest:.2f} s)"

    def _advice(self, plan: Plan, verdict: Feasibility) -> str:
        """Return what would make a motion feasible that the robot's tolerances forbid: once, as it takes long.

        A higher speed is no advice: the search tries these itself.
        """
        if self._advised:
            return ""
        found = self._task.advice(plan, verdict)
        self._advised = bool(found)
        return f"; within the limits with {found}" if found else ""

    def _durations(self, paces: Sequence[Pace]) -> list[tuple[float, ...]]:
        """Return the durations to try, whole numbers of samples."""
        rate_hz = self._task.rate_hz
        if self._duration is Speed.FASTEST:
            chosen = [pace.fastest for pace in paces]
        else:
            chosen = [pace.comfortable for pace in paces]
        if not isinstance(self._duration, Speed):
            share = self._duration / sum(chosen)
            return [tuple(max(1, round(one * share * rate_hz)) / rate_hz for one in chosen)]
        given = self._task.sensing
        factors = QUICKER_OR_SLOWER if given is not None and given.declared else SLOWER
        return [
            tuple(
                math.ceil(min(max(one * factor, pace.fastest), pace.slowest) * rate_hz - 1e-6) / rate_hz
                for one, pace in zip(chosen, paces, strict=True)
            )
            for factor in factors
        ]


def _branch(task: Task, plan: Plan, crossing: Crossing) -> Branch:
    motion = plan.path.at(crossing.time)
    svd = parallel_svd(state_from_platform(task.robot, *task.working_mode, crossing.x, crossing.y, 0.0, 0.0))
    return Branch(crossing, "stretched" if svd.fold < 0.0 else "folded", math.hypot(motion.vx, motion.vy))
