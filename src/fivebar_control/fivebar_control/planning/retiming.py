# SPDX-License-Identifier: Apache-2.0
"""Chooses the pace of a trajectory and keeps its path: quick, and by the dynamic criterion where it crosses Type 2.

The path is a spline through the rows, by the length between them. `toppra` finds the quickest passage that the motors
allow, friction and gravity included; it is averaged over a short time, and bent about each crossing of the Type 2
locus. Of the paces that are slower by fixed factors the first one is taken that the screen accepts.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.motion_queue import LONGEST_MOTION
from fivebar_control.planning.orders import IN_FILE, TimedPoint
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.plan_along import plan_along
from fivebar_control.planning.timed_points import MOST_POINTS, TimedPoints
from fivebar_control.trajectory.criterion import criterion_terms
from fivebar_control.trajectory.optimal import CrossedWay, OptimalLaw, bent_about, goes_forwards, passage_on
from fivebar_control.trajectory.path import Path, crossings_on
from fivebar_control.trajectory.refusal import PlanRefused, place
from fivebar_control.trajectory.spline import Knots, SplineSegment, SplineWay, completed
from fivebar_control.trajectory.time_scaling import progress, time_fraction
from fivebar_description.interface import PLATFORM_NAMES

FloatArray = NDArray[np.float64]

SPACING = 2e-4
"""Least distance (m) between points of the path: between nearer rows their rounding would decide the direction."""

OFF_PATH = 2e-5
"""Largest distance (m) of a row from the path."""

WINDOW = 0.04
"""Time (s) over which the quickest passage is averaged, at most `LARGEST_WINDOW` as a share of it."""

LARGEST_WINDOW = 0.02

REACH = 3.0
"""So many windows on either side of a crossing the passage is bent there."""

HELD = 2e-3
"""Length of the path (m) on either side of a crossing within which the quickest passage keeps to the criterion."""

HELD_WITHIN = 1.0 / 300.0
"""Remainder of s'' - rho s'^2 there, as a share of what the torque limit gives to s'' along the way."""

SLOWER = (2.0, 1.4, 1.0, 2.8, 4.0, 5.6, 8.0)
"""Factors on the quickest duration, in the order in which they are tried: first a quarter of the torque that
accelerates, then quicker, since a crossing may not be slow, then slower, as errors may ask for."""

STEP = 5e-3
"""Time (s) between the rows that are made, at least."""


def retimed_points(task: Task, points: TimedPoints, start: Point) -> TimedPoints:
    """Return points on the path of some others, at times and with velocities and accelerations that are feasible.

    Args:
        task: for which they are timed.
        points: of the platform.
        start: where it rests at the beginning (m).

    Raises:
        PlanRefused: the points are those of the motors, the path has no length or an end at which it cannot rest, or it
            is feasible at no pace; the message names a row where one is concerned.
    """
    if points.joints != PLATFORM_NAMES:
        raise PlanRefused("--retime: the file has no columns of the platform, x_m and y_m, whose path could be kept")
    places = [start, *((point.position[0], point.position[1]) for point in points.points)]
    way = way_through(places)
    _refuse_out_of_reach(task, points)
    _refuse_off_path(way, places)
    grid = _grid_of(way)
    mode = task.working_mode
    crossed = crossings_on(task.robot, mode, way, grid.tolist())
    terms = [criterion_terms(task.robot, mode, way, share) for share in crossed]
    ratios, pushes = tuple(term.ratio for term in terms), [term.push for term in terms]
    path = CrossedWay(way, crossed, ratios)  # type: ignore[arg-type]
    rows = _limited(task, path, pushes, grid)
    # in a unit of time in which torques along the path are about 1, since the solver's tolerances are absolute
    unit = math.sqrt(float(np.nanmedian(np.abs(rows[1, :, :2]))))
    rows[1:] /= unit * unit
    passage = passage_on(grid, rows, lambda whole: min(WINDOW / (whole * unit), LARGEST_WINDOW))
    if passage is None:
        raise PlanRefused(
            "--retime: the path has no passage of bounded torque that only goes forwards, at any pace: expected a path"
            " without a corner or a turn on the Type 2 locus"
        )
    reasons = []
    for factor in SLOWER:
        duration = math.ceil(factor * passage.duration * unit * task.rate_hz) / task.rate_hz
        if duration > LONGEST_MOTION:
            continue
        # the push of gravity does not go with the square of the duration, as all else does
        pushed = [push * duration * duration for push in pushes]
        law = bent_about(passage.law, path, pushed, REACH * passage.law.window)
        if law is None or not goes_forwards(law):
            reasons.append(f"in {duration:.3g} s it does not go forwards where it crosses the Type 2 locus")
            continue
        timed = _sampled(way, crossed, law, duration, task.rate_hz)
        knots = Knots(np.array([(knot.time, *knot.position, *knot.velocity, *knot.acceleration) for knot in timed]))
        segment = SplineSegment(knots, task.robot, 0)
        plan = plan_along(task.robot, Path([segment]), task.working_mode, task.rate_hz)
        verdict = task.judge_run(plan)
        if verdict.feasible:
            return TimedPoints(PLATFORM_NAMES, timed, IN_FILE)
        reasons.append(f"in {duration:.3g} s {'; '.join(verdict.reasons)}")
    raise PlanRefused(f"--retime: the path is feasible at none of {len(SLOWER)} paces: {reasons[0]}")


def way_through(rows: Sequence[Point]) -> SplineWay:
    """Return the path through rows (m), of which those that are too near to others are left out.

    Raises:
        PlanRefused: it has no length.
    """
    kept = [rows[0]]
    for row in rows[1:]:
        if math.dist(row, kept[-1]) >= SPACING:
            kept.append(row)
    if math.dist(rows[-1], kept[-1]) > 0.0:
        # the end is kept, in place of a point that is too near
        kept[-1 if len(kept) > 1 else len(kept) :] = [rows[-1]]
    if len(kept) < 2:
        raise PlanRefused(f"--retime: the path is shorter than {SPACING:g} m")
    lengths = np.concatenate(([0.0], np.cumsum([math.dist(*pair) for pair in pairwise(kept)]))).tolist()
    ends = [_direction(*kept[:2]), *[None] * (len(kept) - 2), _direction(*kept[-2:])]
    straight = (0.0, 0.0)
    return SplineWay(completed(lengths, kept, ends, [straight, *[None] * (len(kept) - 2), straight]))


def _direction(begin: Point, end: Point) -> Point:
    length = math.dist(begin, end)
    return (end[0] - begin[0]) / length, (end[1] - begin[1]) / length


def _grid_of(way: SplineWay) -> FloatArray:
    """Return the shares of a way at its knots, and between them where these are few, float64[N]."""
    length = way.knots[-1].time
    at: list[float] = []
    for before, after in pairwise(way.knots):
        parts = max(1, math.ceil((after.time - before.time) / (2.0 * SPACING)))
        at += [before.time + (after.time - before.time) * part / parts for part in range(parts)]
    return np.array([*at, length]) / length


def _limited(task: Task, path: CrossedWay, pushes: Sequence[float], grid: FloatArray) -> FloatArray:
    """Return what may be at most 1 along a path, [3, N, rows]: torques, motor speeds, the criterion at crossings."""
    # loaded by plans of this kind only
    from fivebar_control.trajectory.passage_torques import friction_along, torques_along

    robot, way, limits = task.robot, path.way, task.limits
    mode = task.working_mode
    torques = torques_along(robot, mode, way, grid)
    torques[0] += friction_along(robot, mode, way, grid)
    torques /= limits.torque_share * limits.torque
    speeds = np.zeros((3, len(grid), 2))
    for number, share in enumerate(grid.tolist()):
        x, y, d_x, d_y, _, _ = way.at(share)
        state = state_from_platform(robot, mode, x, y, d_x, d_y)
        speeds[2, number] = state.leg1.dq1**2, state.leg2.dq1**2
    speeds /= (limits.speed_share * limits.motor_speed) ** 2
    held = np.zeros((3, len(grid), 1))
    size = float(np.nanmedian(np.abs(torques[1])))
    length = way.knots[-1].time  # type: ignore[union-attr]
    for share, ratio, push in zip(path.crossed, path.ratios, pushes, strict=True):
        near = np.abs(grid - share) * length <= HELD
        held[:, near, 0] = np.array([[-push], [1.0], [-ratio]]) * size / HELD_WITHIN
    return np.concatenate((torques, speeds, held), axis=2)


def _sampled(
    way: SplineWay, crossed: Sequence[float], law: OptimalLaw, duration: float, rate_hz: int
) -> tuple[TimedPoint, ...]:
    """Return points of a way that is passed by a law in a duration (s), with those at which it crosses the locus."""
    period = max(1, math.ceil(STEP * rate_hz), math.ceil(duration * rate_hz / (MOST_POINTS // 2)))
    crossings = [duration * time_fraction(law.__call__, share) for share in crossed]
    # exactly at the crossings, near which others are left out
    even = (sample / rate_hz for sample in range(period, round(duration * rate_hz), period))
    kept = [t for t in even if min(abs(t - other) for other in (*crossings, 0.0, duration)) >= 0.5 * STEP]
    points = []
    for t in sorted((0.0, *kept, *crossings, duration)):
        at = way.moved(*progress(law.__call__, t, duration))
        points.append(TimedPoint(t, at[:2], at[2:4], at[4:]))
    points[0] = points[0]._replace(velocity=(0.0, 0.0), acceleration=(0.0, 0.0))
    points[-1] = points[-1]._replace(velocity=(0.0, 0.0), acceleration=(0.0, 0.0))
    return tuple(points)


def _refuse_out_of_reach(task: Task, points: TimedPoints) -> None:
    for number, point in enumerate(points.points):
        x, y = point.position
        state = state_from_platform(task.robot, task.working_mode, x, y, 0.0, 0.0)
        if not all(math.isfinite(value) for value in (state.leg1.q1, state.leg2.q1)):
            raise PlanRefused(f"{points.labels.of(number)}: {place(x, y)} is out of reach")


def _refuse_off_path(way: SplineWay, rows: Sequence[Point]) -> None:
    """Refuse a path that leaves out more than what the spacing of its points may."""
    length = way.knots[-1].time
    number, knots = 0, way.knots
    for row in rows:
        while number + 1 < len(knots) and math.dist(row, knots[number + 1][1:3]) <= math.dist(row, knots[number][1:3]):
            number += 1
        near = knots[number].time + np.linspace(-2.0, 2.0, 9) * SPACING
        distance = min(math.dist(row, way.at(at / length)[:2]) for at in near.tolist())
        if distance > OFF_PATH + 0.5 * SPACING:
            raise PlanRefused(
                f"--retime: the row at {place(*row)} is {1e3 * distance:.2f} mm from the path through its neighbours:"
                f" expected rows at least {1e3 * SPACING:g} mm apart where the path turns"
            )


def as_csv(points: TimedPoints) -> str:
    """Return points of the platform with their velocities and accelerations as the text of a file."""
    lines = ["time_s,x_m,y_m,vx_m_s,vy_m_s,ax_m_s2,ay_m_s2"]
    lines += [",".join(map(repr, (p.time, *p.position, *p.velocity, *p.acceleration))) for p in points.points]
    return "\n".join(lines) + "\n"
