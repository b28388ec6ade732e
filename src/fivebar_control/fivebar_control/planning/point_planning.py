# SPDX-License-Identifier: Apache-2.0
"""Plans motions through points at given times."""

from __future__ import annotations

import math

from fivebar_control.model.kinematics import state_from_motors, state_from_platform, working_mode
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import State
from fivebar_control.planning.feasibility import screen_run
from fivebar_control.planning.figures import Feasibility
from fivebar_control.planning.orders import TrajectoryRequest
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.plan_along import plan_along
from fivebar_control.planning.timed_points import segment_of
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.refusal import PlanRefused
from fivebar_control.trajectory.spline import SplineSegment
from fivebar_description.parameters import FiveBar


def plan_points(task: Task, request: TrajectoryRequest) -> Plan:
    """Plan a motion through knots, and screen it as every motion is.

    Raises:
        PlanRefused: it is not feasible.
    """
    plan = plan_knots(task.robot, request, task.rate_hz, task.limits.rest)
    verdict = screen_run(task.robot, plan, task.rate_hz, task.follower, task.limits, task.sensing)
    refuse_infeasible(request, verdict)
    return plan


def refuse_infeasible(request: TrajectoryRequest, verdict: Feasibility) -> None:
    """Refuse a motion through knots that breaks a limit; each reason names the knot after which it does.

    Raises:
        PlanRefused: it does.
    """
    if not verdict.feasible:
        missed = (figure for figure in verdict.figures if not figure.kept)
        reasons = [f"{figure}, after {request.label_at(figure.time)}" for figure in missed]
        raise PlanRefused(f"the trajectory is not feasible: {'; '.join([*reasons, *verdict.causes])}")


def plan_knots(robot: FiveBar, request: TrajectoryRequest, rate_hz: int, least_kappa: float) -> Plan:
    """Plan a motion through knots without judging it.

    Args:
        robot: to be moved.
        request: the knots, and where the robot rests.
        rate_hz: of the controllers.
        least_kappa: 1/cond(A) below which motor angles do not fix the platform.

    Raises:
        PlanRefused: it has no reference everywhere.
    """
    segment = segment_of(robot, request)
    for sample in range(math.ceil(segment.duration * rate_hz) + 1):
        _check_regular(robot, request, segment, sample / rate_hz, least_kappa)
    return plan_along(robot, Path([segment]), request.working_mode, rate_hz)


def _check_regular(
    robot: FiveBar, request: TrajectoryRequest, segment: SplineSegment, t: float, least_kappa: float
) -> None:
    """Refuse an instant without a defined reference: out of reach, or where motors do not fix the platform."""
    at = segment.coordinates_at(t)
    if not segment.assembly:
        if not _defined(state_from_platform(robot, request.working_mode, at.coordinate1, at.coordinate2, 0.0, 0.0)):
            place = f"({at.coordinate1:.4f}, {at.coordinate2:.4f}) m"
            raise PlanRefused(f"at {t:.3f} s, after {request.label_at(t)}, the platform is out of reach: {place}")
        return
    state = state_from_motors(robot, segment.assembly, at.coordinate1, at.coordinate2, 0.0, 0.0)
    motors = (
        f"at {t:.3f} s, after {request.label_at(t)}, the motors are at ({at.coordinate1:.4f}, {at.coordinate2:.4f}) rad"
    )
    if not _defined(state):
        raise PlanRefused(f"{motors}: the distal links cannot meet")
    if inverse_condition(state) < least_kappa:
        raise PlanRefused(f"{motors}, near the Type 2 locus, where they do not fix the platform: expected x and y")
    if working_mode(state) != request.working_mode:
        raise PlanRefused(f"{motors}: they have gone through a Type 1 singularity")


def _defined(state: State) -> bool:
    return all(math.isfinite(value) for value in (state.x, state.y, state.leg1.q1, state.leg2.q1))
