# SPDX-License-Identifier: Apache-2.0
"""Other places of crossing: through gates that start and goal see, far enough from each other."""

from __future__ import annotations

import math
import time
from itertools import pairwise
from types import SimpleNamespace

import pytest

from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.model.singularity import FOLDED, STRETCHED
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning import alternative_courses, roadmap
from fivebar_control.planning.alternative_courses import APART, PLACES, chart_for, courses_elsewhere
from fivebar_control.planning.figures import DWELL, TORQUE
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.roadmap import PASSING_COST, Gate
from fivebar_control.planning.transfer import TransferRefused, plan_transfer, transfer_along
from fivebar_description.parameters import FiveBar, laden

MODE = (1, -1)
START, GOAL = (0.0, 0.15), (0.0, 0.02)


def task(robot: FiveBar, working_mode: WorkingMode = MODE, **limits: object) -> Task:
    follower = default_tuning(CONTROLLERS["unified"])
    return Task(robot, working_mode, 500, follower, MotionLimits()._replace(**limits))


def test_each_course_crosses_once_and_elsewhere(robot: FiveBar) -> None:
    known = plan_transfer(Task(robot, MODE, 500), START, GOAL)
    found = list(courses_elsewhere(task(robot), START, GOAL, known.plan))
    assert 2 <= len(found) <= PLACES
    crossings = [known.crossings[0]]
    for timed in found:
        assert (timed.course.waypoints[0], timed.course.waypoints[-1]) == (START, GOAL)
        assert all(round(500 * one) == pytest.approx(500 * one) for one in timed.durations)
        moved = transfer_along(task(robot), timed)
        (crossing,) = moved.crossings
        assert all(math.hypot(crossing.x - one.x, crossing.y - one.y) > 0.5 * APART for one in crossings)
        crossings.append(crossing)
        # a crossing at an estimated pace is neither slow nor beyond the motors
        assert moved.feasibility.feasible
        assert moved.durations == timed.durations
    # too quick for the motors
    with pytest.raises(TransferRefused, match="torque"):
        transfer_along(task(robot), found[0]._replace(durations=(0.05, 0.05, 0.05)))


def test_none_where_nothing_is_crossed_or_elbows_must_not_pass(robot: FiveBar) -> None:
    beside = plan_transfer(Task(robot, MODE, 500), START, (0.02, 0.15))
    assert not beside.crossings
    assert list(courses_elsewhere(task(robot), START, (0.02, 0.15), beside.plan)) == []
    known = plan_transfer(Task(robot, MODE, 500), START, GOAL)
    found = courses_elsewhere(task(robot, elbows_pass=False), START, GOAL, known.plan)
    branches = [transfer_along(task(robot), one).crossings[0].distal_links for one in found]
    assert set(branches) <= {STRETCHED}


@pytest.mark.parametrize(("start", "goal"), [((-0.103, 0.024), (0.077, -0.06)), ((0.119, -0.018), (-0.103, 0.066))])
def test_alternative_courses_where_elbows_pass_come_later_whichever_way_a_gate_is_passed(
    dextar: FiveBar, start: Point, goal: Point
) -> None:
    mode = (1, 1)
    wide = task(dextar, mode)
    known = plan_transfer(Task(dextar, mode, 500), start, goal)
    drawn, branches, lengths, costs = chart_for(wide).gates, [], [], []
    for timed in courses_elsewhere(wide, start, goal, known.plan):
        points = timed.course.waypoints
        assert (Gate(*points[1:3]) in drawn) != (Gate(points[2], points[1]) in drawn)
        branches.append(wide.plan(*timed).crossings[0].distal_links)
        lengths.append(sum(math.dist(*pair) for pair in pairwise(points)))
        costs.append(lengths[-1] + (PASSING_COST if branches[-1] == FOLDED else 0.0))
    assert set(branches) == {STRETCHED, FOLDED}
    assert costs == sorted(costs)
    assert lengths != sorted(lengths)


@pytest.mark.extra
def test_a_place_counts_only_where_the_whole_course_keeps_the_limits(dextar: FiveBar) -> None:
    known = plan_transfer(Task(dextar, MODE, 500), START, GOAL)

    def dwells(limit: float) -> list[float]:
        found = []
        for timed in courses_elsewhere(task(dextar, dwell=limit), START, GOAL, known.plan):
            verdict = task(dextar).judge(task(dextar).plan(*timed))
            assert all(figure.kept for figure in verdict.figures if figure.name != TORQUE)
            dwell = verdict.figure(DWELL)
            assert dwell is not None
            found.append(dwell.value)
        return found

    limit = 0.012
    free, bound = dwells(MotionLimits().dwell), dwells(limit)
    assert max(free) > limit > min(free)
    assert bound and max(bound) <= limit


def test_no_gate_is_tried_when_the_time_is_over(robot: FiveBar, monkeypatch: pytest.MonkeyPatch) -> None:
    known = plan_transfer(Task(robot, MODE, 500), START, GOAL)
    assert list(courses_elsewhere(task(robot), START, GOAL, known.plan, time.monotonic())) == []
    # the map is drawn before what is looked at in it is counted
    gates = chart_for(task(robot)).gates
    clock, looks = SimpleNamespace(now=0.0), []

    def look_along(*line: object) -> object:
        looks.append(line)
        return seen(*line)

    seen = roadmap.look_along
    monkeypatch.setattr(roadmap, "look_along", look_along)
    monkeypatch.setattr(alternative_courses, "time", SimpleNamespace(monotonic=lambda: clock.now))
    found = courses_elsewhere(task(robot), START, GOAL, known.plan, until=1.0)
    next(found)
    # gates behind the first place have not been looked at yet
    looked = len(looks)
    assert looked < 2 * len(gates)
    clock.now = 1.0
    assert list(found) == []
    assert len(looks) == looked


def test_the_map_is_that_of_the_geometry(robot: FiveBar) -> None:
    assert chart_for(task(laden(robot, 3.0))) is chart_for(task(robot))
    longer = robot._replace(leg1=robot.leg1._replace(distal=robot.leg1.distal + 1e-3))
    assert chart_for(task(longer)) is not chart_for(task(robot))
