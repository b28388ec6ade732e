# SPDX-License-Identifier: Apache-2.0
"""Where and how quickly a motion under way can stop: within the limits of every motion, and not near the locus."""

from __future__ import annotations

import math

from fivebar_control.model.singularity import inverse_condition
from fivebar_control.planning.feasibility import screen_run
from fivebar_control.planning.orders import Stop, StopRequest
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.plan_along import plan_along, state_along
from fivebar_control.trajectory.path import Path
from fivebar_control.trajectory.refusal import PlanRefused
from fivebar_control.trajectory.stopped import ResumedSegment, StoppedSegment
from fivebar_description.parameters import FiveBar

SLOWING = (0.1, 0.2, 0.4, 0.8)
"""Times (s) within which a motion is tried to be stopped, the shortest first."""

LATER = 0.02
"""Time (s) by which a stop is put off at a time where it cannot be made."""

MOST_SCREENED = 20
"""Stops that are screened."""


def plan_stop(task: Task, request: StopRequest) -> Stop:
    """Return the earliest and quickest stop that keeps the limits; one from which the motion can go on, if it pauses.

    Raises:
        PlanRefused: there is none before the motion ends.
    """
    robot, rate_hz, path = task.robot, task.rate_hz, Path(request.segments)
    screened, reason = 0, "it ends before it could"

    def judged(motion: StoppedSegment | ResumedSegment) -> str:
        """Return why a motion is not feasible, "" if it is."""
        plan = plan_along(robot, motion.as_path(), request.working_mode, rate_hz)
        return "; ".join(screen_run(robot, plan, rate_hz, task.follower, task.limits, task.sensing).reasons)

    begin = request.earliest
    while begin < path.duration and screened < MOST_SCREENED:
        for slowing in SLOWING:
            stop = StoppedSegment(path, begin, slowing)
            if stop.end >= path.duration or _nearest(robot, request, stop, rate_hz) < task.limits.rest:
                continue
            screened += 1
            refused = judged(stop)
            if not refused and not request.pauses:
                return Stop(stop)
            if not refused:
                for resumed in (ResumedSegment(path, stop.end, rising) for rising in SLOWING):
                    refused = judged(resumed)
                    if not refused:
                        return Stop(stop, resumed)
                refused = f"it could not go on from there: {refused}"
            reason = refused
        begin += max(1, round(LATER * rate_hz)) / rate_hz
    raise PlanRefused(f"the motion goes on to its end, since no stop is feasible: {reason}")


def _nearest(robot: FiveBar, request: StopRequest, stop: StoppedSegment, rate_hz: int) -> float:
    """Return the least kappa while a motion slows down."""
    samples = range(math.floor(stop.begin * rate_hz), math.ceil(stop.duration * rate_hz) + 1)
    path, mode = stop.as_path(), request.working_mode
    return min(inverse_condition(state_along(robot, path, mode, sample / rate_hz)) for sample in samples)
