# SPDX-License-Identifier: Apache-2.0
"""Trajectories at another pace: the path is kept, every crossing meets the dynamic criterion, limits are kept."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.planning.limits import motion_limits_of
from fivebar_control.planning.orders import IN_FILE, TimedPoint
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.plan_along import plan_along
from fivebar_control.planning.retiming import SPACING, as_csv, retimed_points, way_through
from fivebar_control.planning.timed_points import TimedPoints
from fivebar_control.trajectory.criterion import criterion_residual
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_control.trajectory.spline import Knots, SplineSegment
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot

MODE = (1, -1)
Place = tuple[float, float]


def task_for(robot: FiveBar, torque: float) -> Task:
    follower = default_tuning(CONTROLLERS["unified"])
    return Task(robot, MODE, 500, follower, motion_limits_of(follower, torque, 40.0))


def points_at(places: list[Place], step: float = 1.0) -> TimedPoints:
    rows = tuple(TimedPoint(step * number, place) for number, place in enumerate(places))
    return TimedPoints(("x", "y"), rows, IN_FILE)


def line(begin: Place, end: Place, rows: int) -> list[Place]:
    return [
        (begin[0] + (end[0] - begin[0]) * n / rows, begin[1] + (end[1] - begin[1]) * n / rows) for n in range(rows + 1)
    ]


def segment_of(points: TimedPoints, robot: FiveBar) -> SplineSegment:
    rows = [(one.time, *one.position, *one.velocity, *one.acceleration) for one in points.points]
    return SplineSegment(Knots(np.array(rows)), robot, 0)


BENT = [(0.015 * math.sin(math.pi * n / 200), 0.15 - 0.13 * n / 200) for n in range(201)]
"""From above to below the locus of DexTAR on a bow."""


def test_the_path_is_kept_and_every_crossing_meets_the_criterion(dextar: FiveBar) -> None:
    """A row for each second, at which pace the robot would all but rest on the locus."""
    found = retimed_points(task_for(dextar, 2.0), points_at(BENT), BENT[0])
    path = Path([segment_of(found, dextar)])
    assert path.duration < 2.0
    plan = plan_along(dextar, path, MODE, 500)
    (crossing,) = plan.crossings
    motion = path.at(crossing.time)
    force = criterion_residual(dextar, MODE, motion)
    assert abs(force) < 0.02 * dextar.mass * math.hypot(motion.ax, motion.ay) + 1e-3
    places = np.array([path.at(t)[:2] for t in np.linspace(0.0, path.duration, 2001)])
    assert max(np.min(np.hypot(*(places - np.array(row)).T)) for row in BENT) < 1e-4
    between = [(0.015 * math.sin(math.pi * s), 0.15 - 0.13 * s) for s in np.linspace(0.0, 1.0, 20_001)]
    assert max(np.min(np.hypot(*(np.array(between) - place).T)) for place in places[::20]) < 1e-5
    for end in (0.0, path.duration - 1e-9):
        assert path.at(end)[2:4] == pytest.approx((0.0, 0.0), abs=1e-6)


def test_gravity_in_the_plane_is_counted_with() -> None:
    robot = load_robot("motkin_vertical")
    places = line((0.0, 0.12), (0.0, 0.0), 100)
    found = retimed_points(task_for(robot, 0.186), points_at(places), places[0])
    path = Path([segment_of(found, robot)])
    (crossing,) = plan_along(robot, path, MODE, 500).crossings
    motion = path.at(crossing.time)
    weight = robot.mass * 9.81
    assert abs(criterion_residual(robot, MODE, motion)) < 0.05 * weight
    # the platform falls while it crosses: without acceleration its weight alone would be left over
    still = motion._replace(ax=0.0, ay=0.0)
    assert abs(criterion_residual(robot, MODE, still)) > 0.5 * weight


def test_less_torque_takes_longer(dextar: FiveBar) -> None:
    strong, weak = (retimed_points(task_for(dextar, torque), points_at(BENT), BENT[0]) for torque in (2.0, 0.8))
    assert weak.points[-1].time > 1.2 * strong.points[-1].time


def test_a_path_out_of_reach_is_refused_with_its_row(dextar: FiveBar) -> None:
    places = [*line((0.0, 0.15), (0.0, 0.17), 4), (0.0, 0.9)]
    with pytest.raises(PlanRefused, match=r"row 7: \(0.0000, 0.9000\) m is out of reach"):
        retimed_points(task_for(dextar, 2.0), points_at(places), places[0])


def test_motors_and_points_alone_are_refused(dextar: FiveBar) -> None:
    task = task_for(dextar, 2.0)
    with pytest.raises(PlanRefused, match="no columns of the platform"):
        retimed_points(task, TimedPoints(("q11", "q21"), (TimedPoint(0.0, (1.0, 2.0)),)), (0.0, 0.15))
    with pytest.raises(PlanRefused, match="shorter than"):
        retimed_points(task, points_at([(0.0, 0.15), (0.0, 0.15)]), (0.0, 0.15))


def test_rows_nearer_than_their_rounding_do_not_turn_the_path() -> None:
    rows = [(round(1e-6 * n, 6), 0.1) for n in range(10_001)]
    way = way_through(rows)
    assert len(way.knots) <= 0.01 / SPACING + 2
    for s in (0.0, 0.123, 0.5, 1.0):
        x, y, d_x, d_y, b_x, b_y = way.at(s)
        assert (x, y, d_x, d_y) == pytest.approx((0.01 * s, 0.1, 0.01, 0.0), abs=1e-12)
        assert (b_x, b_y) == pytest.approx((0.0, 0.0), abs=1e-8)


def test_the_file_says_times_places_and_derivatives() -> None:
    point = TimedPoint(0.1, (1.0 / 3.0, 0.2), (0.3, 0.4), (0.5, 0.6))
    assert as_csv(TimedPoints(("x", "y"), (point,))).splitlines() == [
        "time_s,x_m,y_m,vx_m_s,vy_m_s,ax_m_s2,ay_m_s2",
        "0.1,0.3333333333333333,0.2,0.3,0.4,0.5,0.6",
    ]
