"""Other places of crossing: through gates that start and goal see, far enough from each other."""

from __future__ import annotations

import math

import pytest

from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.model.singularity import STRETCHED
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.places import APART, PLACES, courses_elsewhere
from fivebar_control.planning.transfer import TransferRefused, plan_transfer, transfer_along
from fivebar_description.parameters import FiveBar

MODE = (1, -1)


def task(robot: FiveBar, **limits: object) -> Task:
    follower = default_tuning(CONTROLLERS["unified"])
    return Task(robot, MODE, 500, follower, MotionLimits()._replace(**limits))


def test_each_course_crosses_once_and_elsewhere(robot: FiveBar) -> None:
    start, goal = (0.0, 0.15), (0.0, 0.02)
    known = plan_transfer(robot, MODE, start, goal, None, 500)
    found = courses_elsewhere(task(robot), start, goal, known.plan)
    assert 2 <= len(found) <= PLACES
    crossings = [known.crossings[0]]
    for timed in found:
        assert (timed.course.waypoints[0], timed.course.waypoints[-1]) == (start, goal)
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
    start, goal = (0.0, 0.15), (0.0, 0.02)
    beside = plan_transfer(robot, MODE, start, (0.02, 0.15), None, 500)
    assert not beside.crossings
    assert courses_elsewhere(task(robot), start, (0.02, 0.15), beside.plan) == []
    known = plan_transfer(robot, MODE, start, goal, None, 500)
    found = courses_elsewhere(task(robot, elbows_pass=False), start, goal, known.plan)
    branches = [transfer_along(task(robot), one).crossings[0].distal_links for one in found]
    assert set(branches) <= {STRETCHED}
