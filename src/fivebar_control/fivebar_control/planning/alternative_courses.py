# SPDX-License-Identifier: Apache-2.0
"""Other places at which a motion may cross the Type 2 locus: through a gate of the map that both of its ends see."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import NamedTuple

from fivebar_control.planning.course import Course
from fivebar_control.planning.figures import SPEED, TORQUE
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.pacing import COMFORT, Task
from fivebar_control.planning.postures import place_at
from fivebar_control.planning.roadmap import PASSING_COST, Gate, Roadmap, roadmap
from fivebar_control.trajectory.planner import Plan, PlanRefused
from fivebar_control.trajectory.time_laws import OPTIMAL
from fivebar_description.robot_file import UNKNOWN

PLACES = 4
"""Other places that are tried for better odds."""

APART = 0.03
"""Least distance (m) between two places that are proposed."""

TRIALS = 1.0, 0.5
"""Durations (s) of a leg by whose torques and speeds its own duration is estimated."""

CROSSING_COMFORT = 1.3
"""A crossing takes so much longer than the shortest duration by its torque: the quicker, the less a load moves it."""


class TimedCourse(NamedTuple):
    """A course with the durations (s) of its legs."""

    course: Course
    durations: tuple[float, ...]

    @property
    def duration(self) -> float:
        """How long it takes (s)."""
        return sum(self.durations)


def chart_for(task: Task) -> Roadmap:
    """Return the map by which a task's motions are planned, drawn once."""
    limits = task.limits
    return roadmap(task.robot, task.working_mode, limits.serial_margin, limits.rest, limits.elbows_pass)


def courses_elsewhere(
    task: Task, start: Point, goal: Point, known: Plan, until: float = math.inf
) -> Iterator[TimedCourse]:
    """Yield courses from a rest to another one (m), across the locus through other places than a known motion.

    There are `PLACES` at most, and none where the known motion does not cross once.

    Each goes straight to a gate, through it, and straight to the goal, with rests at both ends of the gate. Short ones
    come first, and those at which the elbows do not pass each other. Their durations are estimates; in these they keep
    all limits, but for the reference's torque, which the predicted run has to judge, and what it predicts besides.

    Args:
        task: for which they are planned.
        start, goal: rests, in different assembly modes where the known motion crosses once.
        known: the motion that others are sought beside.
        until: when no further gate is tried (s on the steady clock).
    """
    if len(known.crossings) != 1 or time.monotonic() >= until:
        return
    chart = chart_for(task)
    chosen: list[Point] = [(known.crossings[0].x, known.crossings[0].y)]
    for gate in _gates_by_cost(task, chart, start, goal):
        if len(chosen) > PLACES or time.monotonic() >= until:
            return
        middle = (0.5 * (gate.start[0] + gate.end[0]), 0.5 * (gate.start[1] + gate.end[1]))
        if any(math.dist(middle, other) < APART for other in chosen):
            continue
        if not (chart.sees(start, gate.start) and chart.sees(gate.end, goal)):
            continue
        timed = _timed(task, Course((start, *gate, goal), (0.0, 0.0), OPTIMAL).for_robot(task.robot))
        if timed is not None:
            chosen.append(middle)
            yield timed


def _gates_by_cost(task: Task, chart: Roadmap, start: Point, goal: Point) -> list[Gate]:
    """Return all gates as they are passed from start to goal, the shortest way first."""
    side = place_at(task.robot, task.working_mode, *start).assembly

    def passed(gate: Gate) -> Gate:
        same = place_at(task.robot, task.working_mode, *gate.start).assembly == side
        return gate if same else Gate(gate.end, gate.start)

    def cost(gate: Gate) -> float:
        passing = PASSING_COST if task.limits.elbows_pass == UNKNOWN and chart.folded(gate) else 0.0
        return math.dist(start, gate.start) + math.dist(*gate) + math.dist(gate.end, goal) + passing

    return sorted((passed(gate) for gate in chart.gates), key=cost)


def _timed(task: Task, course: Course) -> TimedCourse | None:
    """Return a course with durations of its legs (s), None where planner or screen refuse it in these."""
    durations = []
    for part in course.between_rests():
        estimate = _estimate(task, part)
        if estimate is None:
            return None
        durations.append(math.ceil(estimate * task.rate_hz) / task.rate_hz)
    try:
        verdict = task.judge(task.plan(course, durations))
    except PlanRefused:
        return None
    kept = all(figure.kept for figure in verdict.figures if figure.name != TORQUE)
    return TimedCourse(course, tuple(durations)) if kept else None


def _estimate(task: Task, part: Course) -> float | None:
    """Return a duration (s) of a straight part by the torques and speeds that it has in two others.

    The torque that accelerates falls with the square of the duration, the one against friction stays; the speed falls
    with the duration.
    """
    judged = []
    for trial in TRIALS:
        try:
            plan = task.plan(part, (trial,))
        except PlanRefused:
            return None
        verdict = task.judge(plan)
        judged.append([figure for name in (TORQUE, SPEED) if (figure := verdict.figure(name)) is not None])
    (slow, quick), ((torque, speed), (larger, _)) = TRIALS, judged
    accelerating = (larger.value - torque.value) / (quick**-2 - slow**-2)
    left = torque.limit - (torque.value - accelerating * slow**-2)
    if not (accelerating > 0.0 and left > 0.0):
        return None
    least = max(math.sqrt(accelerating / left), slow * speed.value / speed.limit)
    return (CROSSING_COMFORT if plan.crossings else COMFORT) * least
