"""Requests for motions through points at given times, of the platform or the motors, as in trajectory messages."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from fivebar_control.laws.registry import TunedController
from fivebar_control.model.geometry import direct_geometry
from fivebar_control.model.kinematics import assembly_mode, state_from_motors, state_from_platform, working_mode
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import State
from fivebar_control.planning.feasibility import screen_run
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.motion_queue import LONGEST_MOTION, GoalRefused
from fivebar_control.planning.plan_along import plan_along
from fivebar_control.planning.predicted_estimate import Sensing
from fivebar_control.planning.sight import Point
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.refusal import PlanRefused
from fivebar_control.trajectory.spline import Knot, SplineSegment, completed
from fivebar_description.interface import ACTIVE_JOINTS, PLATFORM_NAMES
from fivebar_description.outside_text import one_line
from fivebar_description.parameters import FiveBar

MOST_POINTS = 100
"""Points of a request."""

SHORTEST_STEP = 1e-3
"""Least time (s) from one point to the next."""

LARGEST = 1e6
"""Largest magnitude of a number in a request."""

SAME_PLACE, SAME_ANGLE = 1e-3, 0.01
"""How far (m, rad) from where the robot rests the first point may be, where it is at time 0; the motion begins at rest
where the robot is."""

Pair = tuple[float, float]


class TimedPoint(NamedTuple):
    """A point of a request: when (s), where, and where they are given, rates and their derivatives."""

    time: float
    position: Sequence[float]
    velocity: Sequence[float] = ()
    acceleration: Sequence[float] = ()


class TimedPoints(NamedTuple):
    """A checked request: its coordinates in the order of `PLATFORM_NAMES` or `ACTIVE_JOINTS`."""

    joints: tuple[str, str]
    points: tuple[TimedPoint, ...]


class TrajectoryRequest(NamedTuple):
    """A request to the planner: a motion through knots.

    Attributes:
        joints: `PLATFORM_NAMES` or `ACTIVE_JOINTS`.
        knots: the first where the robot rests.
        place: where the platform rests (m).
        working_mode: of the whole motion.
        payload: what the platform carries (kg).
    """

    joints: tuple[str, str]
    knots: tuple[Knot, ...]
    place: Point
    working_mode: tuple[int, int]
    payload: float = 0.0


def read_points(joints: Sequence[str], points: Sequence[TimedPoint]) -> TimedPoints:
    """Return the request that named columns of numbers make.

    Raises:
        GoalRefused: names are unknown, there are too few or too many points, times do not rise, or a number is missing,
            not finite or too large.
    """
    found = next((known for known in (PLATFORM_NAMES, ACTIVE_JOINTS) if sorted(joints) == sorted(known)), None)
    if found is None:
        names = ", ".join(one_line(name, 30) for name in joints[:4])
        raise GoalRefused(f"joint_names [{names}]: expected x and y for the platform, or q11 and q21 for the motors")
    if not 1 <= len(points) <= MOST_POINTS:
        raise GoalRefused(f"{len(points)} points: expected 1 to {MOST_POINTS}")
    order = [list(joints).index(name) for name in found]
    read = tuple(_read_point(number, point, points[0], order) for number, point in enumerate(points))
    for number, (before, after) in enumerate(pairwise(read), start=1):
        if not after.time >= before.time + SHORTEST_STEP:
            raise GoalRefused(
                f"points[{number}].time_from_start: {after.time:g} s after {before.time:g} s: expected times that rise"
                f" by at least {SHORTEST_STEP:g} s"
            )
    if not (read[0].time >= 0.0 and read[-1].time <= LONGEST_MOTION):
        raise GoalRefused(
            f"time_from_start: {read[0].time:g} to {read[-1].time:g} s: expected times from 0 to {LONGEST_MOTION:g} s"
        )
    return TimedPoints(found, read)


def _read_point(number: int, point: TimedPoint, first: TimedPoint, order: Sequence[int]) -> TimedPoint:
    columns = {}
    for field, values, alike in (
        ("positions", point.position, (1, 1)),
        ("velocities", point.velocity, first.velocity),
        ("accelerations", point.acceleration, first.acceleration),
    ):
        expected = len(order) if len(alike) else 0
        if len(values) != expected or not all(abs(value) <= LARGEST for value in values):
            finite = f"finite numbers of at most {LARGEST:g} in magnitude"
            shown = ", ".join(f"{value:g}" for value in values[:4]) + (", ..." if len(values) > 4 else "")
            wanted = f"{expected} {finite}" if expected else "none, as in the first point"
            raise GoalRefused(f"points[{number}].{field} [{shown}]: expected {wanted}")
        columns[field] = tuple(float(values[index]) for index in order) if expected else ()
    if point.acceleration and not point.velocity:
        raise GoalRefused(f"points[{number}].accelerations: expected only beside velocities")
    return TimedPoint(point.time, columns["positions"], columns["velocities"], columns["accelerations"])


def request_from(
    robot: FiveBar, wanted: TimedPoints, place: Point, mode: tuple[int, int], angles: Pair, payload: float
) -> TrajectoryRequest:
    """Return the request to the planner for a robot at rest.

    Args:
        robot: its parameters.
        wanted: the points.
        place: where its platform rests (m).
        mode: its working mode.
        angles: of its motors as measured (rad), whose whole turns count.
        payload: what its platform carries (kg).

    Raises:
        GoalRefused: the points begin elsewhere, or begin or end in motion, or there is nowhere to go.
    """
    by_motors = wanted.joints == ACTIVE_JOINTS
    rest = _motors_at(robot, mode, place, angles) if by_motors else place
    points = list(wanted.points)
    first = points[0]
    unit, near = ("rad", SAME_ANGLE) if by_motors else ("m", SAME_PLACE)
    if first.time == 0.0:
        if math.dist(first.position, rest) > near:
            raise GoalRefused(
                f"points[0] at time 0: ({first.position[0]:.4f}, {first.position[1]:.4f}) {unit}: expected where the"
                f" robot rests, ({rest[0]:.4f}, {rest[1]:.4f}) {unit}"
            )
        points[0] = first._replace(position=rest)
    else:
        points.insert(0, TimedPoint(0.0, rest, (0.0, 0.0), (0.0, 0.0)))
    if len(points) < 2:
        raise GoalRefused("points: expected one at least after time 0")
    for name, number in (("begins", 0), ("ends", -1)):
        if any(points[number].velocity):
            raise GoalRefused(f"points[{number}].velocities: the motion {name} at rest: expected 0")
    rates, bends = [_pair(point.velocity) for point in points], [_pair(point.acceleration) for point in points]
    rates[0] = rates[-1] = (0.0, 0.0)
    bends[0], bends[-1] = bends[0] or (0.0, 0.0), bends[-1] or (0.0, 0.0)
    positions = [(point.position[0], point.position[1]) for point in points]
    knots = completed([point.time for point in points], positions, rates, bends)
    return TrajectoryRequest(wanted.joints, knots, place, mode, payload)


def _pair(values: Sequence[float]) -> Pair | None:
    return (values[0], values[1]) if values else None


def _motors_at(robot: FiveBar, mode: tuple[int, int], place: Point, angles: Pair) -> Pair:
    """Return the motors' angles at a place of the platform (rad), in the turns in which they are measured."""
    state = state_from_platform(robot, *mode, *place, 0.0, 0.0)
    q11, q21 = (
        angle + math.tau * round((measured - angle) / math.tau) if math.isfinite(measured) else angle
        for angle, measured in zip((state.leg1.q1, state.leg2.q1), angles, strict=True)
    )
    return q11, q21


def end_of(robot: FiveBar, request: TrajectoryRequest) -> Point:
    """Return where the platform ends (m); NaN where its distal links cannot meet."""
    last = request.knots[-1]
    if request.joints == PLATFORM_NAMES:
        return last.one, last.two
    return direct_geometry(robot, _assembly(robot, request), last.one, last.two)


def _assembly(robot: FiveBar, request: TrajectoryRequest) -> int:
    return assembly_mode(state_from_platform(robot, *request.working_mode, *request.place, 0.0, 0.0))


def segment_of(robot: FiveBar, request: TrajectoryRequest) -> SplineSegment:
    """Return the motion; one of the motors stays in the assembly mode in which it begins."""
    return SplineSegment(request.knots, robot, 0 if request.joints == PLATFORM_NAMES else _assembly(robot, request))


def plan_points(
    robot: FiveBar,
    request: TrajectoryRequest,
    rate_hz: int,
    follower: TunedController,
    limits: MotionLimits,
    sensing: Sensing | None,
) -> Plan:
    """Plan a motion through knots, and screen it as every motion is.

    Raises:
        PlanRefused: it is not feasible.
    """
    segment = segment_of(robot, request)
    for sample in range(math.ceil(segment.duration * rate_hz) + 1):
        _check_regular(robot, request, segment, sample / rate_hz, limits)
    plan = plan_along(robot, Path([segment]), request.working_mode, rate_hz)
    verdict = screen_run(robot, plan, rate_hz, follower, limits, sensing)
    if not verdict.feasible:
        raise PlanRefused(f"the trajectory is not feasible: {'; '.join(verdict.reasons)}")
    return plan


def _check_regular(
    robot: FiveBar, request: TrajectoryRequest, segment: SplineSegment, t: float, limits: MotionLimits
) -> None:
    """Refuse an instant without a defined reference: out of reach, or where motors do not fix the platform."""
    at = segment.coordinates_at(t)
    if not segment.assembly:
        if not _defined(state_from_platform(robot, *request.working_mode, at.one, at.two, 0.0, 0.0)):
            raise PlanRefused(f"at {t:.3f} s the platform is out of reach: ({at.one:.4f}, {at.two:.4f}) m")
        return
    state = state_from_motors(robot, segment.assembly, at.one, at.two, 0.0, 0.0)
    motors = f"at {t:.3f} s the motors are at ({at.one:.4f}, {at.two:.4f}) rad"
    if not _defined(state):
        raise PlanRefused(f"{motors}: the distal links cannot meet")
    if inverse_condition(state) < limits.rest:
        raise PlanRefused(f"{motors}, near the Type 2 locus, where they do not fix the platform: expected x and y")
    if working_mode(state) != request.working_mode:
        raise PlanRefused(f"{motors}: they have gone through a Type 1 singularity")


def _defined(state: State) -> bool:
    return all(math.isfinite(value) for value in (state.x, state.y, state.leg1.q1, state.leg2.q1))
