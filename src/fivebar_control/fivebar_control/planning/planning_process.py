"""Plans requests in a process of its own, so that a node in real time never waits for a plan.

The process ends when the other end of a pipe closes: when it is no longer wanted, even in the middle of a plan, and
when its parent ends, however that comes about.
"""

from __future__ import annotations

import math
import os
import subprocess
from collections.abc import Callable, Mapping
from functools import lru_cache, partial
from multiprocessing.connection import Connection, Pipe
from typing import Any, NamedTuple, cast

from fivebar_control.laws.law import TunedLaw
from fivebar_control.laws.registry import TunedController, default_tuning, find_controller
from fivebar_control.loop.plan_sample import references_along
from fivebar_control.planning.course import NO_COURSE, Course
from fivebar_control.planning.limits import MotionLimits, Risk, motion_limits_of, speed_step_of
from fivebar_control.planning.motion_queue import PlanningRequest
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.places import TimedCourse
from fivebar_control.planning.predicted_estimate import Sensing
from fivebar_control.planning.ride_through import LONGEST, longest_hold
from fivebar_control.planning.stopping import Stop, StopRequest, plan_stop
from fivebar_control.planning.timed_points import TrajectoryRequest, plan_points
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import plan_transfer, transfer_along
from fivebar_control.safety.stages import EVERYWHERE, Area, SafetySettings
from fivebar_control.trajectory.path import AnySegment, Path
from fivebar_control.trajectory.path_distance import TIMED
from fivebar_control.trajectory.planner import Plan, PlanRefused
from fivebar_control.trajectory.rounded import RESTS
from fivebar_description.forbidden import kept_clear_of
from fivebar_description.loads import NO_LOADS, Loads
from fivebar_description.modules import load_part, module_command
from fivebar_description.parameters import FiveBar, laden
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.strict_yaml import InputError

WORKER = "fivebar_control.planning.planning_worker"

Order = PlanningRequest | TrajectoryRequest | StopRequest
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

    def follower(self, file: RobotFile) -> TunedController:
        """Return the controller with its settings."""
        controller = find_controller(self.controller)
        if self.law is None:
            return default_tuning(controller, file)
        return TunedController(controller, TunedLaw(controller.nominal, self.law))


class Planned(NamedTuple):
    """The answer to a request: a motion, or the reason why there is none.

    Attributes:
        refused: the reason, "" where it is not refused; where it is, the other fields are empty.
        course: where it goes.
        durations: of the legs (s).
        segments: between rests, as planned: who follows them needs no planner.
        stop: how the motion under way stops, and goes on where it pauses.
        odds: how likely the motion is to succeed, as `goal/status` tells it; None where no robots are drawn.
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
    references: tuple[float, ...] = ()
    resumed: tuple[float, ...] = ()

    def path(self) -> Path:
        """Return the motion."""
        return Path(self.segments)


DEAD = Planned("the planning process has died")


class PlanningProcess:
    """Plans one request at a time; its methods wait for a plan only where they are asked to."""

    def __init__(self, conditions: Conditions, gives_way: bool = False) -> None:
        """Do not start a process before there is a request, or `start`.

        It gives way to other processes where a control cycle follows the clock; in lockstep, time waits for its plans.
        """
        self._conditions = conditions
        self._gives_way = gives_way
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._processors = os.sched_getaffinity(0)
        self._number = 0
        self._awaited = False
        self._ready = False

    def start(self) -> None:
        """Start the process before a control cycle runs: that takes some milliseconds, and loading a processor."""
        if self._process is None:
            self._start(at_once=False)

    def _start(self, at_once: bool) -> Connection:
        """Start the process, which gives way, if at all, at once or after it has loaded everything."""
        _leave_priority_to_this_thread()
        # not forked, since a process with threads, as a node is, must not be
        connection, far_end = Pipe()
        self._process = subprocess.Popen(
            [*module_command(WORKER), str(far_end.fileno())],
            stdin=subprocess.DEVNULL,
            pass_fds=(far_end.fileno(),),
            # an interrupt is for the parent, who then ends this process
            start_new_session=True,
        )
        far_end.close()
        self._connection, self._ready = connection, False
        # this thread may have been bound to processors since: the planning stays off them
        connection.send((self._gives_way, at_once, self._processors, self._conditions))
        return connection

    @property
    def pid(self) -> int | None:
        """Its process id, None while there is none."""
        return None if self._process is None else self._process.pid

    def loading(self) -> bool:
        """Return whether the process runs and has not loaded everything yet; returns at once."""
        if self._process is not None and not self._ready:
            self._receive()
        return self._process is not None and not self._ready

    def ask(self, order: Order) -> None:
        """Hand in a request, which takes the place of one under way; returns at once."""
        self._number += 1
        if self._connection is not None:
            try:
                self._connection.send((self._number, order))
            except OSError:
                # the process has died since its last answer
                self.close()
        if self._connection is None:
            # by the clock a cycle is under way, which loading must not disturb either
            self._start(at_once=True).send((self._number, order))
        self._awaited = True

    def answer(self, wait: float = 0.0) -> Planned | None:
        """Return the answer, None while it is not ready; waits for it no longer than asked to (s)."""
        if not self._awaited:
            return None
        planned = self._receive(wait)
        if planned is not None:
            self._awaited = False
        return planned

    def forget(self) -> None:
        """Drop the request under way; the process still answers it, before it takes the next one."""
        self._awaited = False

    def close(self) -> None:
        """End the process, whatever it is doing."""
        process, connection = self._process, self._connection
        self._process = self._connection = None
        self._awaited = self._ready = False
        if connection is not None:
            connection.close()
        if process is not None:
            process.kill()
            process.wait()

    def _receive(self, wait: float = 0.0) -> Planned | None:
        """Return the answer to the present request, if it has come."""
        if self._connection is None:
            return DEAD
        try:
            while self._connection.poll(wait):
                number, planned = self._connection.recv()
                self._ready, wait = True, 0.0
                if number == self._number and planned is not None:
                    return cast(Planned, planned)
        except (EOFError, OSError):
            self.close()
            return DEAD
        return None


def _leave_priority_to_this_thread() -> None:
    """Have processes and threads that this thread starts begin at ordinary priority: it may be a control loop's."""
    policy = os.sched_getscheduler(0)
    if policy in (os.SCHED_FIFO, os.SCHED_RR):
        os.sched_setscheduler(0, policy | os.SCHED_RESET_ON_FORK, os.sched_getparam(0))


def planner_of(conditions: Conditions) -> Callable[[Order], Planned]:
    """Return what plans requests under some conditions: `plan_once`, or the planner that they name."""
    if not conditions.planner:
        return partial(plan_once, conditions)
    found: Callable[[Order], Planned] = load_part(conditions.planner)(conditions)
    return found


@lru_cache(maxsize=256)
def plan_once(conditions: Conditions, order: Order) -> Planned:
    """Plan a request as `plan_order` does; one that has been planned before, as in a loop, is not planned again."""
    return plan_order(conditions, order)


def task_of(conditions: Conditions, order: Order) -> Task:
    """Return what the motion of a request is planned for.

    Raises:
        PlanRefused: no motion can keep the limits.
    """
    file = read_robot(conditions.robot)
    robot, follower = laden(file.five_bar(), order.payload), conditions.follower(file)
    shares = (order.torque_share, order.speed_share) if isinstance(order, PlanningRequest) else (1.0, 1.0)
    limits = _limits(conditions, file, follower, *shares)
    return Task(robot, order.working_mode, conditions.rate_hz, follower, limits, conditions.sensing)


def plan_timed(conditions: Conditions, order: PlanningRequest, timed: TimedCourse) -> Planned:
    """Plan and screen the motion of a request along a course in given durations, as `plan_order` would."""
    try:
        task = task_of(conditions, order)
        transfer = transfer_along(task, timed)
        _check_held(conditions, task.robot, transfer.plan, task.follower)
    except (PlanRefused, InputError) as refusal:
        return Planned(str(refusal))
    path = transfer.plan.path
    references = _references(task.follower, path, conditions.rate_hz)
    return Planned("", timed.course, timed.durations, path.segments, references=references)


def plan_order(conditions: Conditions, order: Order) -> Planned:
    """Plan what a request asks for, and screen it with the controller that will follow it."""
    try:
        robot, mode, rate_hz, follower, limits, sensing = task_of(conditions, order)
        if isinstance(order, StopRequest):
            return _stopped(plan_stop(robot, order, rate_hz, follower, limits, sensing), follower, rate_hz)
        if isinstance(order, PlanningRequest):
            transfer = plan_transfer(
                robot,
                mode,
                order.start,
                order.goal,
                order.assembly or None,
                rate_hz,
                follower,
                limits,
                order.duration or Speed.COMFORTABLE,
                sensing,
                order.via,
                order.blend_radius or RESTS,
            )
            plan, course, durations = transfer.plan, transfer.course, transfer.durations
        else:
            plan = plan_points(robot, order, rate_hz, follower, limits, sensing)
            end = plan.path.at(plan.path.duration)
            course, durations = Course((order.place, (end.x, end.y))), (plan.path.duration,)
        _check_held(conditions, robot, plan, follower)
    except (PlanRefused, InputError) as refusal:
        return Planned(str(refusal))
    return Planned("", course, durations, plan.path.segments, references=_references(follower, plan.path, rate_hz))


def _stopped(found: Stop, follower: TunedController, rate_hz: int) -> Planned:
    """Return the answer to a request to stop."""
    resumed = found.resumed
    later = () if resumed is None else _references(follower, resumed.as_path(), rate_hz)
    return Planned(stop=found, references=_references(follower, found.stop.as_path(), rate_hz), resumed=later)


def _references(follower: TunedController, path: Path, rate_hz: int) -> tuple[float, ...]:
    """Return all references of a motion in one row, for a law that has to know them; else nothing."""
    if not follower.controller.follows_motions:
        return ()
    return tuple(value for one in references_along(path, rate_hz) for value in one)


def _limits(
    conditions: Conditions, file: RobotFile, follower: TunedController, torque_share: float, speed_share: float
) -> MotionLimits:
    """Return what a requested motion has to keep that may use shares of the limits of torque and speed."""
    counts = None if conditions.sensing is None else conditions.sensing.drives.encoder_counts
    step = speed_step_of(conditions.rate_hz, counts)
    torque, speed = torque_share * conditions.torque_limit, speed_share * conditions.motor_speed
    allowed = MotionLimits(
        judge=conditions.judge,
        tracking_error=conditions.tracking_error_limit,
        error_tolerance=conditions.error_tolerance,
        risk=conditions.risk,
        loads=conditions.loads,
        forbidden=kept_clear_of(conditions.forbidden, file.forbidden),
        workspace=conditions.workspace,
        elbows_pass=file.elbows_pass,
    )
    return motion_limits_of(follower, torque, speed, step, allowed=allowed)


def _check_held(conditions: Conditions, robot: FiveBar, plan: Plan, follower: TunedController) -> None:
    """Check that a motion bears how long the last torque may be held.

    Raises:
        PlanRefused: it does not.
    """
    wanted = min(conditions.held, LONGEST)
    bears = longest_hold(robot, plan, follower, conditions.torque_limit)
    if bears.time < wanted:
        raise PlanRefused(
            f"the last torque may be held for {wanted * 1e3:g} ms, the motion bears {bears.time * 1e3:g} ms of it at"
            f" {bears.worst:.3f} s: expected a longer duration, or a lower safety.stop_time_ms"
        )
