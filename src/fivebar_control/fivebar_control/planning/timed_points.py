# SPDX-License-Identifier: Apache-2.0
"""Requests for motions through points at given times, of the platform or the motors, as in trajectory messages."""

from __future__ import annotations

import hashlib
import math
from array import array
from collections.abc import Sequence
from itertools import pairwise
from typing import Any, NamedTuple

from fivebar_control.model.geometry import direct_geometry
from fivebar_control.model.kinematics import assembly_mode, state_from_platform
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.motion_queue import LONGEST_MOTION, GoalRefused
from fivebar_control.planning.orders import (
    IN_MESSAGE,
    PointLabels,
    TimedPoint,
    TrajectoryMessage,
    TrajectoryRequest,
)
from fivebar_control.trajectory.spline import Knots, SplineSegment, completed
from fivebar_description.interface import ACTIVE_JOINTS, PLATFORM_NAMES
from fivebar_description.outside_text import one_line
from fivebar_description.parameters import FiveBar
from fivebar_description.whole_turns import nearest_turn

MOST_POINTS = 100_000
"""Points of a request."""

SHORTEST_STEP = 1e-3
"""Least time (s) from one point to the next."""

DIGEST_LENGTH = 16

ROUNDED = 1.0 - 1e-6
"""Share of the least time that is enough, since times are rounded."""

LARGEST = 1e6
"""Largest magnitude of a number in a request."""

SAME_PLACE, SAME_ANGLE = 1e-3, 0.01
"""How far (m, rad) from where the robot rests the first point may be, where it is at time 0; the motion begins at rest
where the robot is."""

Pair = tuple[float, float]


class TimedPoints(NamedTuple):
    """A checked request: its coordinates in the order of `PLATFORM_NAMES` or `ACTIVE_JOINTS`.

    Attributes:
        joints: names of the coordinates.
        points: where the robot is when.
        labels: how messages name the points.
    """

    joints: tuple[str, str]
    points: tuple[TimedPoint, ...]
    labels: PointLabels = IN_MESSAGE

    def start(self) -> Point | None:
        """Return where the platform is at time 0 (m); None where the points do not say so."""
        first = self.points[0]
        if self.joints != PLATFORM_NAMES or first.time != 0.0:
            return None
        return first.position[0], first.position[1]


def read_points(joints: Sequence[str], points: Sequence[TimedPoint], labels: PointLabels = IN_MESSAGE) -> TimedPoints:
    """Return the request that named columns of numbers make; refusals name the points by the labels.

    Raises:
        GoalRefused: names are unknown, there are too few or too many points, times do not rise, or a number is missing,
            not finite or too large.
    """
    coordinates = next((known for known in (PLATFORM_NAMES, ACTIVE_JOINTS) if sorted(joints) == sorted(known)), None)
    if coordinates is None:
        names = ", ".join(one_line(name, 30) for name in joints[:4])
        raise GoalRefused(f"joint_names [{names}]: expected x and y for the platform, or q11 and q21 for the motors")
    if not 1 <= len(points) <= MOST_POINTS:
        raise GoalRefused(f"{len(points)} points: expected 1 to {MOST_POINTS}")
    order = [list(joints).index(name) for name in coordinates]
    read = tuple(
        _read_point(f"{labels.of(number)}{labels.joint}", point, points[0], order)
        for number, point in enumerate(points)
    )
    for number, (before, after) in enumerate(pairwise(read), start=1):
        if not after.time >= before.time + ROUNDED * SHORTEST_STEP:
            raise GoalRefused(
                f"{labels.of(number)}{labels.time}: {after.time:g} s after {before.time:g} s: expected times that rise"
                f" by at least {SHORTEST_STEP:g} s"
            )
    if not (read[0].time >= 0.0 and read[-1].time <= LONGEST_MOTION):
        times = f"{labels.time[1:].strip()}: {read[0].time:g} to {read[-1].time:g} s"
        raise GoalRefused(f"{times}: expected times from 0 to {LONGEST_MOTION:g} s")
    return TimedPoints(coordinates, read, labels)


def _read_point(label: str, point: TimedPoint, first: TimedPoint, order: Sequence[int]) -> TimedPoint:
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
            raise GoalRefused(f"{label}{field} [{shown}]: expected {wanted}")
        columns[field] = tuple(float(values[index]) for index in order) if expected else ()
    if point.acceleration and not point.velocity:
        raise GoalRefused(f"{label}accelerations: expected only beside velocities")
    return TimedPoint(point.time, columns["positions"], columns["velocities"], columns["accelerations"])


def request_from(
    robot: FiveBar, wanted: TimedPoints, place: Point, mode: WorkingMode, angles: Pair, payload: float
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
    points, labels = list(wanted.points), wanted.labels
    first = points[0]
    unit, near = ("rad", SAME_ANGLE) if by_motors else ("m", SAME_PLACE)
    if first.time == 0.0:
        if math.dist(first.position, rest) > near:
            requested, robot_rests = (
                f"({value1:.4f}, {value2:.4f}) {unit}" for value1, value2 in (first.position, rest)
            )
            raise GoalRefused(f"{labels.of(0)} at time 0: {requested}: expected where the robot rests, {robot_rests}")
        points[0] = first._replace(position=rest)
    else:
        points.insert(0, TimedPoint(0.0, rest, (0.0, 0.0), (0.0, 0.0)))
        labels = labels.after_rest()
    if len(points) < 2:
        raise GoalRefused("points: expected one at least after time 0")
    for name, number in (("begins", 0), ("ends", len(points) - 1)):
        if any(points[number].velocity):
            raise GoalRefused(f"{labels.of(number)}{labels.joint}velocities: the motion {name} at rest: expected 0")
    return TrajectoryRequest(wanted.joints, tuple(points), place, mode, payload, labels)


def read_request(robot: FiveBar, message: TrajectoryMessage) -> tuple[TrajectoryRequest, dict[str, Any]]:
    """Return the request that a message makes, and what tells it from others, by which a bag has it.

    Raises:
        GoalRefused: it makes none.
    """
    wanted: TimedPoints = message.read(message.data, message.base_frame)
    request = request_from(robot, wanted, message.place, message.working_mode, message.angles, message.payload)
    followed: dict[str, Any] = {"trajectory": digest_of(wanted)}
    if request.joints == ACTIVE_JOINTS:
        followed["motors"] = [angle if math.isfinite(angle) else 0.0 for angle in message.angles]
    return request, followed


def knots_of(request: TrajectoryRequest) -> Knots:
    """Return the knots of a motion from rest to rest through the points of a request."""
    points = request.points
    rates, accelerations = [_pair(point.velocity) for point in points], [_pair(point.acceleration) for point in points]
    rates[0] = rates[-1] = (0.0, 0.0)
    accelerations[0], accelerations[-1] = accelerations[0] or (0.0, 0.0), accelerations[-1] or (0.0, 0.0)
    positions = [(point.position[0], point.position[1]) for point in points]
    return completed([point.time for point in points], positions, rates, accelerations)


def digest_of(wanted: TimedPoints) -> str:
    """Return what tells a request from others, by which a bag has it."""
    numbers = (value for point in wanted.points for part in (point[:1], *point[1:]) for value in part)
    digest = hashlib.sha256(array("d", numbers).tobytes())
    digest.update(" ".join(wanted.joints).encode())
    return digest.hexdigest()[:DIGEST_LENGTH]


def _pair(values: Sequence[float]) -> Pair | None:
    return (values[0], values[1]) if values else None


def _motors_at(robot: FiveBar, mode: WorkingMode, place: Point, angles: Pair) -> Pair:
    """Return the motors' angles at a place of the platform (rad), in the turns in which they are measured."""
    state = state_from_platform(robot, mode, *place, 0.0, 0.0)
    return nearest_turn(state.leg1.q1, angles[0]), nearest_turn(state.leg2.q1, angles[1])


def end_of(robot: FiveBar, request: TrajectoryRequest) -> Point:
    """Return where the platform ends (m); NaN where its distal links cannot meet."""
    first, second = request.points[-1].position
    if request.joints == PLATFORM_NAMES:
        return first, second
    return direct_geometry(robot, _assembly(robot, request), first, second)


def _assembly(robot: FiveBar, request: TrajectoryRequest) -> int:
    return assembly_mode(state_from_platform(robot, request.working_mode, *request.place, 0.0, 0.0))


def segment_of(robot: FiveBar, request: TrajectoryRequest) -> SplineSegment:
    """Return the motion; one of the motors stays in the assembly mode in which it begins."""
    return SplineSegment(knots_of(request), robot, 0 if request.joints == PLATFORM_NAMES else _assembly(robot, request))
