# SPDX-License-Identifier: Apache-2.0
"""Plans a motion along a course that is given: straight from one via point to the next, at rest or round the corner."""

from __future__ import annotations

from fivebar_control.planning.course import Course
from fivebar_control.planning.pacing import LONGEST, NoPace, Task, slowest_pace
from fivebar_control.planning.timing import DurationSearch, Speed, Timed, courses_for, quickest
from fivebar_control.trajectory.planner import PlanRefused


def along(task: Task, course: Course, duration: float | Speed) -> Timed | str:
    """Return the motion along a course, or why there is none; where rests would do what corners do not, this too.

    Args:
        task: for which it is planned.
        course: to be kept to.
        duration: of the whole motion (s), or how to choose it.
    """
    motion = _quickest(task, course, duration)
    if isinstance(motion, Timed) or not course.rounded:
        return motion
    rests = _quickest(task, Course.through(course.waypoints).for_robot(task.robot), duration)
    if isinstance(rests, Timed):
        return f"{motion}; with blend_radius 0, a rest in each of them, it takes {sum(rests.durations):.3g} s"
    return motion


def _quickest(task: Task, course: Course, duration: float | Speed) -> Timed | str:
    return quickest([_tried(task, variant, duration) for variant in courses_for(course, duration)])


def _tried(task: Task, course: Course, duration: float | Speed) -> Timed | str:
    try:
        # the whole first: a refusal of one part would count its waypoints from its own start
        task.plan(course, course.shared(LONGEST))
    except PlanRefused as refusal:
        return str(refusal)
    slowest = []
    for part in course.between_rests():
        pace = slowest_pace(task, part)
        if isinstance(pace, NoPace):
            return pace.reason
        slowest.append(pace)
    return DurationSearch(task, duration).timed(course, slowest)
