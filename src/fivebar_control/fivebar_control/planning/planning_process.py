"""Plans requests in a process of its own, so that a node in real time never waits for a plan.

The process ends when the other end of a pipe closes: when it is no longer wanted, even in the middle of a plan, and
when its parent ends, however that comes about.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import threading
from concurrent.futures import Future, ProcessPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import suppress
from functools import lru_cache
from multiprocessing.connection import Connection
from typing import NamedTuple

from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.planning.limits import MotionLimits, Risk, limits_of
from fivebar_control.planning.motion_queue import PlanningRequest
from fivebar_control.planning.predicted_estimate import Sensing
from fivebar_control.planning.ride_through import LONGEST, longest_hold
from fivebar_control.planning.sight import Point
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import plan_transfer
from fivebar_control.trajectory.path import AnySegment, Path
from fivebar_control.trajectory.planner import QUINTIC, PlanRefused
from fivebar_control.trajectory.rounded import RESTS
from fivebar_description.forbidden import named_bounds
from fivebar_description.loads import NO_LOADS, Loads
from fivebar_description.parameters import laden, read_robot
from fivebar_description.strict_yaml import InputError

NICENESS = 10
"""By how much the planning process gives way to others."""


class Conditions(NamedTuple):
    """What requests are planned for.

    Attributes:
        robot: name or path.
        rate_hz: of the controllers.
        torque_limit, motor_speed: of both motors (Nm, rad/s).
        error_tolerance, risk: of a robot within its tolerances (m).
        sensing: what the estimator has, None without one.
        loads: what the robot has to bear.
        held: time (s) for which the last torque may be held, which a motion has to bear; 0 where it never is.
    """

    robot: str
    rate_hz: int
    torque_limit: float
    motor_speed: float
    error_tolerance: float = MotionLimits().error_tolerance
    risk: Risk = Risk()
    sensing: Sensing | None = None
    loads: Loads = NO_LOADS
    held: float = 0.0


class Planned(NamedTuple):
    """The answer to a request: a motion, or the reason why there is none.

    Attributes:
        waypoints: of its course (m).
        durations: of the legs (s).
        refused: the reason, "" for none.
        blend_radius: at each waypoint between the first and the last (m), 0 for a rest.
        time_law: of the planner, by which it is passed.
        segments: between rests, as planned: who follows them needs no planner.
    """

    waypoints: tuple[Point, ...]
    durations: tuple[float, ...]
    refused: str
    blend_radius: tuple[float, ...] = ()
    time_law: str = QUINTIC
    segments: tuple[AnySegment, ...] = ()

    @property
    def rounded(self) -> bool:
        """Whether the motion rounds a corner."""
        return any(self.blend_radius)

    def path(self) -> Path:
        """Return the motion."""
        return Path(self.segments)


class PlanningProcess:
    """Plans one request at a time; its methods never wait for a plan."""

    def __init__(self, conditions: Conditions) -> None:
        """Do not start a process before there is a request."""
        self._conditions = conditions
        self._pool: ProcessPoolExecutor | None = None
        self._lifeline: Connection | None = None
        self._planned: Future[Planned] | None = None

    def ask(self, order: PlanningRequest) -> None:
        """Hand in a request; returns at once."""
        try:
            self._planned = self._running().submit(plan_once, self._conditions, order)
        except BrokenProcessPool:
            # the process has died since its last answer
            self.close()
            self._planned = self._running().submit(plan_once, self._conditions, order)

    def answer(self) -> Planned | None:
        """Return the answer, None while it is not ready; returns at once."""
        planned = self._planned
        if planned is None or not planned.done():
            return None
        self._planned = None
        try:
            return planned.result()
        except BrokenProcessPool:
            self.close()
            return Planned((), (), "the planning process has died")
        except Exception as error:
            # an error of the planner refuses this request and must not end the node
            return Planned((), (), f"planning failed: {error!r}")

    def close(self) -> None:
        """End the process, whatever it is doing."""
        pool, lifeline = self._pool, self._lifeline
        self._pool = self._lifeline = self._planned = None
        if lifeline is not None:
            lifeline.close()
        if pool is not None:
            pool.shutdown(cancel_futures=True)

    def _running(self) -> ProcessPoolExecutor:
        if self._pool is None:
            _leave_priority_to_this_thread()
            # a process with threads, as a node is, must not be forked
            context = multiprocessing.get_context("spawn")
            far_end, self._lifeline = context.Pipe(duplex=False)
            self._pool = ProcessPoolExecutor(1, mp_context=context, initializer=_prepare, initargs=(far_end,))
        return self._pool


def _leave_priority_to_this_thread() -> None:
    """Have processes and threads that this thread starts begin at ordinary priority: it may be a control loop's."""
    policy = os.sched_getscheduler(0)
    if policy in (os.SCHED_FIFO, os.SCHED_RR):
        os.sched_setscheduler(0, policy | os.SCHED_RESET_ON_FORK, os.sched_getparam(0))


def _prepare(lifeline: Connection) -> None:
    """Prepare the planning process."""
    # a plan takes a processor for seconds, and the cycle may have no higher priority than any other process
    os.nice(NICENESS)
    # an interrupt is for the parent, who then ends this process
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    threading.Thread(target=_end_with, args=(lifeline,), name="lifeline", daemon=True).start()


def _end_with(lifeline: Connection) -> None:
    with suppress(EOFError, OSError):
        lifeline.recv_bytes()
    os._exit(0)


@lru_cache(maxsize=256)
def plan_once(conditions: Conditions, order: PlanningRequest) -> Planned:
    """Plan a request as `plan_order` does; one that has been planned before, as in a loop, is not planned again."""
    return plan_order(conditions, order)


def plan_order(conditions: Conditions, order: PlanningRequest) -> Planned:
    """Plan a request for the law without switching, the only one that follows requests."""
    file = read_robot(conditions.robot)
    robot = laden(file.five_bar(), order.payload)
    follower = default_tuning(CONTROLLERS["unified"], file)
    torque = order.torque_share * conditions.torque_limit
    limits = limits_of(follower, torque, order.speed_share * conditions.motor_speed)
    try:
        transfer = plan_transfer(
            robot,
            order.working_mode,
            order.start,
            order.goal,
            order.assembly or None,
            conditions.rate_hz,
            follower,
            limits._replace(
                error_tolerance=conditions.error_tolerance,
                risk=conditions.risk,
                loads=conditions.loads,
                forbidden=named_bounds(file.forbidden),
            ),
            order.duration or Speed.COMFORTABLE,
            conditions.sensing,
            order.via,
            order.blend_radius or RESTS,
        )
    except (PlanRefused, InputError) as refusal:
        return Planned((), (), str(refusal))
    wanted = min(conditions.held, LONGEST)
    bears = longest_hold(robot, transfer.plan, follower, conditions.torque_limit)
    if bears.time < wanted:
        return Planned(
            (),
            (),
            f"the last torque may be held for {wanted * 1e3:g} ms, the motion bears {bears.time * 1e3:g} ms of it at"
            f" {bears.worst:.3f} s: expected a longer duration, or a lower safety.stop_time_ms",
        )
    course = transfer.course
    return Planned(
        course.waypoints, transfer.durations, "", course.blend_radius, course.time_law, transfer.plan.path.segments
    )
