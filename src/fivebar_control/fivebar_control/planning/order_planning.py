# SPDX-License-Identifier: Apache-2.0
"""Plans orders, and screens the motions with the controller that will follow them."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache, partial
from typing import Any

from fivebar_control.laws.law import TunedLaw
from fivebar_control.laws.registry import TunedController, default_tuning, find_controller
from fivebar_control.loop.plan_sample import references_along
from fivebar_control.planning.alternative_courses import TimedCourse
from fivebar_control.planning.course import Course
from fivebar_control.planning.limits import MotionLimits, motion_limits_of, speed_step_of
from fivebar_control.planning.motion_queue import GoalRefused
from fivebar_control.planning.orders import (
    Conditions,
    Order,
    Planned,
    PlanningRequest,
    Stop,
    StopRequest,
    TrajectoryMessage,
)
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.point_planning import plan_points
from fivebar_control.planning.ride_through import LONGEST, longest_hold
from fivebar_control.planning.stopping import plan_stop
from fivebar_control.planning.timed_points import read_request
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import plan_transfer, transfer_along
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.planner import Plan, PlanRefused
from fivebar_control.trajectory.rounded import RESTS
from fivebar_description.forbidden import kept_clear_of
from fivebar_description.modules import load_part
from fivebar_description.parameters import FiveBar, laden
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.strict_yaml import InputError


def planner_of(conditions: Conditions) -> Callable[[Order], Planned]:
    """Return what plans requests under some conditions: `plan_once`, or the planner that they name."""
    if not conditions.planner:
        return partial(plan_once, conditions)
    planner: Callable[[Order], Planned] = load_part(conditions.planner)(conditions)
    return planner


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
    robot, follower = laden(file.five_bar(), order.payload), follower_of(conditions, file)
    shares = (order.torque_share, order.speed_share) if isinstance(order, PlanningRequest) else (1.0, 1.0)
    limits = _limits(conditions, file, follower, *shares)
    return Task(robot, order.working_mode, conditions.rate_hz, follower, limits, conditions.sensing)


def follower_of(conditions: Conditions, file: RobotFile) -> TunedController:
    """Return the controller that follows the motions under some conditions, with its settings."""
    controller = find_controller(conditions.controller)
    if conditions.law is None:
        return default_tuning(controller, file)
    return TunedController(controller, TunedLaw(controller.nominal, conditions.law))


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
    followed: dict[str, Any] | None = None
    try:
        task = task_of(conditions, order)
        follower, rate_hz = task.follower, task.rate_hz
        if isinstance(order, StopRequest):
            return _stopped(plan_stop(task, order), follower, rate_hz)
        if isinstance(order, PlanningRequest):
            transfer = plan_transfer(
                task,
                order.start,
                order.goal,
                order.assembly or None,
                order.duration or Speed.COMFORTABLE,
                order.via,
                order.blend_radius or RESTS,
            )
            plan, course, durations = transfer.plan, transfer.course, transfer.durations
        else:
            if isinstance(order, TrajectoryMessage):
                order, followed = read_request(task.robot, order)
            plan = plan_points(task, order)
            end = plan.path.at(plan.path.duration)
            course, durations = Course((order.place, (end.x, end.y))), (plan.path.duration,)
        _check_held(conditions, task.robot, plan, follower)
    except (PlanRefused, InputError, GoalRefused) as refusal:
        return Planned(str(refusal))
    references = _references(follower, plan.path, rate_hz)
    return Planned("", course, durations, plan.path.segments, followed=followed, references=references)


def _stopped(stop: Stop, follower: TunedController, rate_hz: int) -> Planned:
    """Return the answer to a request to stop."""
    resumed = stop.resumed
    later = () if resumed is None else _references(follower, resumed.as_path(), rate_hz)
    return Planned(stop=stop, references=_references(follower, stop.stop.as_path(), rate_hz), resumed=later)


def _references(follower: TunedController, path: Path, rate_hz: int) -> tuple[float, ...]:
    """Return all references of a motion in one row, for a law that has to know them; else nothing."""
    if not follower.controller.follows_motions:
        return ()
    return tuple(value for reference in references_along(path, rate_hz) for value in reference)


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
