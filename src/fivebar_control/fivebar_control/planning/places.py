"""Other places at which a motion may cross the Type 2 locus: through a gate of the map that both of its ends see."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.planning.course import Course
from fivebar_control.planning.figures import SPEED, TORQUE
from fivebar_control.planning.pacing import COMFORT, Task
from fivebar_control.planning.postures import place_at
from fivebar_control.planning.roadmap import PASSING_COST, Gate, roadmap
from fivebar_control.planning.sight import Point, look_along
from fivebar_control.trajectory.planner import OPTIMAL, Plan, PlanRefused
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


def courses_elsewhere(task: Task, start: Point, goal: Point, known: Plan) -> list[TimedCourse]:
    """Return courses from a rest to another one (m), across the locus through other places than a known motion.

    There are `PLACES` at most, and none where the known motion does not cross once.

    Each goes straight to a gate, through it, and straight to the goal, with rests at both ends of the gate. Short ones
    come first, and those at which the elbows do not pass each other. Their durations are estimates: who takes one has
    to judge it.

    Args:
        task: for which they are planned.
        start, goal: rests, in different assembly modes where the known motion crosses once.
        known: the motion that others are sought beside.
    """
    if len(known.crossings) != 1:
        return []
    chosen: list[Point] = [(known.crossings[0].x, known.crossings[0].y)]
    found: list[TimedCourse] = []
    for gate in _gates_seen(task, start, goal):
        if len(found) == PLACES:
            break
        middle = (0.5 * (gate.start[0] + gate.end[0]), 0.5 * (gate.start[1] + gate.end[1]))
        if any(math.dist(middle, other) < APART for other in chosen):
            continue
        timed = _timed(task, Course((start, *gate, goal), (0.0, 0.0), OPTIMAL).for_robot(task.robot))
        if timed is not None:
            chosen.append(middle)
            found.append(timed)
    return found


def _gates_seen(task: Task, start: Point, goal: Point) -> list[Gate]:
    """Return the gates that both rests see, as they are passed from start to goal, the shortest way first."""
    limits = task.limits
    chart = roadmap(task.robot, task.working_mode, limits.serial_margin, limits.rest, limits.elbows_pass)
    side = place_at(task.robot, task.working_mode, *start).assembly

    def sees(one: Point, other: Point) -> bool:
        sight = look_along(task.robot, task.working_mode, one, other, limits.serial_margin, limits.rest)
        return sight.clear and sight.crossings == 0

    def cost(gate: Gate) -> float:
        passing = PASSING_COST if limits.elbows_pass == UNKNOWN and chart.folded(gate) else 0.0
        return math.dist(start, gate.start) + math.dist(*gate) + math.dist(gate.end, goal) + passing

    seen = []
    for gate in chart.gates:
        same = place_at(task.robot, task.working_mode, *gate.start).assembly == side
        passed = gate if same else Gate(gate.end, gate.start)
        if sees(start, passed.start) and sees(passed.end, goal):
            seen.append(passed)
    return sorted(seen, key=cost)


def _timed(task: Task, course: Course) -> TimedCourse | None:
    """Return a course with durations of its legs (s), None where the planner refuses it."""
    durations = []
    for part in course.between_rests():
        estimate = _estimate(task, part)
        if estimate is None:
            return None
        durations.append(math.ceil(estimate * task.rate_hz) / task.rate_hz)
    return TimedCourse(course, tuple(durations))


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
