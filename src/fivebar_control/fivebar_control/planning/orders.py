# SPDX-License-Identifier: Apache-2.0
"""Orders to the planner, the conditions that they are planned for, and its answers."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from typing import Any, NamedTuple

from fivebar_control.estimation.settings import Sensing
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.course import NO_COURSE, Course
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.risk import Risk
from fivebar_control.safety.settings import EVERYWHERE, Area, SafetySettings
from fivebar_control.trajectory.path import AnySegment, Path
from fivebar_control.trajectory.path_distance import TIMED
from fivebar_control.trajectory.stopped import ResumedSegment, StoppedSegment
from fivebar_description.loads import NO_LOADS, Loads


class PlanningRequest(NamedTuple):
    """A request to the planner: from one rest (m) to another one in a working mode; 0 is "as it comes".

    The payload (kg) is what the platform carries, the shares are those of the limits that the motion may use. Via
    points (m) have a blend radius (m) each, 0 for a rest.
    """

    start: Point
    working_mode: WorkingMode
    goal: Point
    assembly: int
    duration: float
    torque_share: float = 1.0
    speed_share: float = 1.0
    payload: float = 0.0
    via: tuple[Point, ...] = ()
    blend_radius: tuple[float, ...] = ()


class PointLabels(NamedTuple):
    """How messages to people name the points of a trajectory: by a form, and the number of the first point."""

    form: str
    first: int
    time: str
    """How they name the time of a point, after the point."""
    joint: str
    """The sign between a point and another field."""
    unnamed: int = 0
    """Points at the beginning that have no name."""

    def of(self, number: int) -> str:
        """Return the name of a point, the first of which has number 0."""
        return self.form.format(self.first + number)

    def after_rest(self) -> PointLabels:
        """Return the labels where the place in which the robot rests, which has none, comes first."""
        return self._replace(first=self.first - 1, unnamed=1)


IN_MESSAGE = PointLabels("points[{}]", 0, ".time_from_start", ".")
IN_FILE = PointLabels("row {}", 2, ": time", ": ")
"""Labels of the points in a message, and in a file of which row 1 has the names of the columns."""


class TimedPoint(NamedTuple):
    """A point of a trajectory: when (s), where, and where they are given, rates and their derivatives."""

    time: float
    position: Sequence[float]
    velocity: Sequence[float] = ()
    acceleration: Sequence[float] = ()


class TrajectoryRequest(NamedTuple):
    """A request to the planner: a motion through points at their times.

    Attributes:
        joints: `PLATFORM_NAMES` or `ACTIVE_JOINTS`.
        points: the first where the robot rests, at time 0.
        place: where the platform rests (m).
        working_mode: of the whole motion.
        payload: what the platform carries (kg).
        labels: how messages name the points.
    """

    joints: tuple[str, str]
    points: tuple[TimedPoint, ...]
    place: Point
    working_mode: WorkingMode
    payload: float = 0.0
    labels: PointLabels = IN_MESSAGE

    @property
    def duration(self) -> float:
        """How long it takes (s)."""
        return self.points[-1].time

    def label_at(self, t: float) -> str:
        """Return the name of the last point that is not after a time (s)."""
        number = bisect_right(self.points, t, key=lambda point: point.time) - 1
        return self.labels.of(max(number, self.labels.unnamed))


class StopRequest(NamedTuple):
    """A request to stop a motion.

    Attributes:
        segments: of the motion, which begins at time 0.
        working_mode: of the whole motion.
        earliest: when it may begin to slow down (s).
        payload: what the platform carries (kg).
        pauses: whether the motion is to go on afterwards.
    """

    segments: tuple[AnySegment, ...]
    working_mode: WorkingMode
    earliest: float
    payload: float = 0.0
    pauses: bool = False


class Stop(NamedTuple):
    """How a motion stops, and goes on afterwards where it pauses."""

    stop: StoppedSegment
    resumed: ResumedSegment | None = None


class TrajectoryMessage(NamedTuple):
    """A request in a message that is not read yet, which would delay a sample; the fields are those of the request.

    Attributes:
        read: makes the points of the message and the base's frame, `TimedPoints`, or refuses them.
        data: the message.
        base_frame: the frame of the base.
        place: where the platform rests (m).
        angles: of the motors as measured (rad).
    """

    read: Callable[[bytes, str], Any]
    data: bytes
    base_frame: str
    place: Point
    working_mode: WorkingMode
    angles: tuple[float, float]
    payload: float = 0.0


Order = PlanningRequest | TrajectoryRequest | TrajectoryMessage | StopRequest
"""An order to plan."""


class Conditions(NamedTuple):
    """The conditions that requests are planned for.

    Attributes:
        robot: name or path.
        rate_hz: of the controllers.
        torque_limit, motor_speed: of both motors (Nm, rad/s).
        judge: by which distance of the platform a motion is judged, that from its reference or that from its path.
        error_tolerance, risk: of a robot within its tolerances (m).
        sensing: what the estimator has, None without one.
        loads: what the robot has to bear.
        held: time (s) for which the last torque may be held, which a motion has to bear; 0 where it never is.
        tracking_error_limit: distance from the reference beyond which the robot is stopped (m).
        workspace: beyond which it is stopped.
        forbidden: postures that it may not enter, in one row; by default those of the robot's file.
        controller: which follows the motion.
        law: settings of its law, None for those of the robot by default.
        planner: what plans motions in place of `plan_once`, as my_package.my_module:function; "" for none.
        file: the run's file, by its path, for that planner.
        odds_time: longest time (s) that this planner may take to find out how likely a motion is to succeed.
    """

    robot: str
    rate_hz: int
    torque_limit: float
    motor_speed: float
    judge: str = TIMED
    error_tolerance: float = MotionLimits().error_tolerance
    risk: Risk = Risk()
    sensing: Sensing | None = None
    loads: Loads = NO_LOADS
    held: float = 0.0
    tracking_error_limit: float = SafetySettings().tracking_error_limit
    workspace: Area = EVERYWHERE
    forbidden: tuple[float, ...] = ()
    controller: str = "unified"
    law: tuple[Any, ...] | None = None
    planner: str = ""
    file: str = ""
    odds_time: float = math.inf


class Planned(NamedTuple):
    """The answer to a request: a motion, or the reason why there is none.

    Attributes:
        refused: the reason, "" where it is not refused; where it is, the other fields are empty.
        course: where it goes.
        durations: of the legs (s).
        segments: between rests, as planned: who follows them needs no planner.
        stop: how the motion under way stops, and goes on where it pauses.
        odds: how likely the motion is to succeed, as `goal/status` tells it; None where no robots are drawn.
        followed: of a motion through points in a message, what tells it from others in `goal/status`.
        references: where the law has to know the whole motion, the six numbers of each of its samples; of a stop, of
            the motion that stops.
        resumed: likewise of the motion that goes on after a pause.
    """

    refused: str = ""
    course: Course = NO_COURSE
    durations: tuple[float, ...] = ()
    segments: tuple[AnySegment, ...] = ()
    stop: Stop | None = None
    odds: Mapping[str, Any] | None = None
    followed: Mapping[str, Any] | None = None
    references: tuple[float, ...] = ()
    resumed: tuple[float, ...] = ()

    def path(self) -> Path:
        """Return the motion."""
        return Path(self.segments)
