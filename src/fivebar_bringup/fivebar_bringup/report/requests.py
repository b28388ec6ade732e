# SPDX-License-Identifier: Apache-2.0
"""The plan of a run that took requests: its own motion, and those that were asked for, when they were made."""

from __future__ import annotations

import math
from collections.abc import Sequence
from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.bag.recording import Recording
from fivebar_bringup.errors import BagError
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.motion_queue import GoalRefused
from fivebar_control.planning.plan_along import plan_along
from fivebar_control.planning.timed_points import TimedPoints, digest_of, request_from, segment_of
from fivebar_control.planning.trajectory_messages import points_of
from fivebar_control.trajectory.path import AnySegment, Path
from fivebar_control.trajectory.planner import Crossing, Plan, plan_motion
from fivebar_control.trajectory.rounded import RESTS
from fivebar_control.trajectory.spline import Knots, SplineSegment
from fivebar_control.trajectory.stopped import ResumedSegment, StoppedSegment
from fivebar_control.trajectory.time_laws import QUINTIC
from fivebar_description.interface import GOAL_STATUS, GOAL_TRAJECTORY, JOINT_STATES
from fivebar_description.parameters import laden
from fivebar_description.status_texts import read_goal_status

MOVES = {"first_sample", "waypoints", "durations_s"}
"""Fields without which a status does not say how the robot moved."""

STOPS, RESUMED = ("stopping", "pausing"), "resumed"
"""States of a motion under way that is to stop, and of one that goes on."""


def plan_with_requests(recording: Recording, scenario: Scenario) -> Plan:
    """Return what a run was to do; with requests or a program that is also to rest as long as it is recorded.

    Raises:
        BagError: the recorded statuses of requests cannot be read.
        InputError: the scenario's motion is refused.
    """
    plan = scenario.plan()
    asked = recording.count(GOAL_STATUS) > 0
    try:
        statuses = recording.read_texts(GOAL_STATUS, read_goal_status, needed=False) if asked else []
        moved = [status for status in statuses if status["state"] in (*STOPS, RESUMED) or status.keys() >= MOVES]
        motions = _motions(scenario, plan, moved, _Trajectories(recording))
    except (ValueError, KeyError, TypeError) as error:
        raise BagError(recording.path, f"/{GOAL_STATUS.name}: is not the status of a request: {error}") from error
    numbers = recording.samples(JOINT_STATES, scenario.rate_hz)
    last = int(numbers.max()) / scenario.rate_hz if numbers.size else 0.0
    segments: list[AnySegment] = []
    crossings: list[Crossing] = []
    for motion in motions:
        crossings += [
            crossing._replace(segment=crossing.segment + len(segments), time=crossing.time + motion.begin)
            for crossing in motion.crossings
        ]
        segments += [segment._replace(start_time=segment.start_time + motion.begin) for segment in motion.segments]
    return plan._replace(path=Path(segments, last), crossings=tuple(crossings))


class _Motion(NamedTuple):
    """A motion that begins at a time (s); its segments and crossings count from there."""

    begin: float
    segments: tuple[AnySegment, ...]
    crossings: tuple[Crossing, ...]


class _Trajectories:
    """The trajectories that were asked for, as recorded."""

    def __init__(self, recording: Recording) -> None:
        self._recording = recording
        self._known: dict[str, TimedPoints] | None = None

    def named(self, digest: str) -> TimedPoints:
        """Return the trajectory of a digest.

        Raises:
            KeyError: it was not recorded.
        """
        if self._known is None:
            self._known = {}
            for message in self._recording.messages(GOAL_TRAJECTORY):
                # what was refused was not followed
                with suppress(GoalRefused):
                    points = points_of(message, message.header.frame_id)
                    self._known[digest_of(points)] = points
        return self._known[digest]


def _motions(
    scenario: Scenario, plan: Plan, statuses: Sequence[dict[str, Any]], trajectories: _Trajectories
) -> list[_Motion]:
    """Return the motion of a run, and those that its statuses tell of, as far as they were followed."""
    motions = [_Motion(0.0, plan.path.segments, plan.crossings)]
    whole = motions[0]
    for status in statuses:
        begin = status["first_sample"] / scenario.rate_hz
        if status["state"] in STOPS:
            # it does not stop near the locus: what is still ahead is not crossed, or later
            whole, at = motions[-1], begin - motions[-1].begin
            slowing = status.get("slowing_s", status["last_sample"] / scenario.rate_hz - begin)
            stopped = StoppedSegment(Path(whole.segments), at, slowing)
            crossed = tuple(crossing._replace(segment=0) for crossing in whole.crossings if crossing.time < at)
            motions[-1] = _Motion(whole.begin, stopped.as_path().segments, crossed)
        elif status["state"] == RESUMED:
            since, rising = status["path_time_s"], status["rising_s"]
            late = 0.5 * rising - since
            ahead = tuple(
                crossing._replace(segment=0, time=crossing.time + late)
                for crossing in whole.crossings
                if crossing.time >= since
            )
            motions.append(
                _Motion(begin, ResumedSegment(Path(whole.segments), since, rising).as_path().segments, ahead)
            )
        else:
            asked = _requested(scenario, plan, status, trajectories)
            motions.append(_Motion(begin, asked.path.segments, asked.crossings))
    return motions


def _requested(scenario: Scenario, plan: Plan, status: dict[str, Any], trajectories: _Trajectories) -> Plan:
    """Return the motion of a status as the planner made it, which knew what the platform carried."""
    if "trajectory" in status:
        robot, mode = scenario.five_bar(), plan.mode
        points, place = trajectories.named(status["trajectory"]), status["waypoints"][0]
        q11, q21 = status.get("motors", (math.nan, math.nan))
        request = request_from(robot, points, (place[0], place[1]), mode, (q11, q21), 0.0)
        return plan_along(robot, Path([segment_of(robot, request)]), mode, scenario.rate_hz)
    if "knots" in status:
        knots = Knots(np.array(status["knots"], dtype=np.float64))
        segment = SplineSegment(knots, scenario.five_bar(), status.get("assembly_mode", 0))
        return plan_along(scenario.five_bar(), Path([segment]), plan.mode, scenario.rate_hz)
    return plan_motion(
        laden(scenario.five_bar(), status.get("payload_kg", 0.0)),
        plan.mode,
        [(x, y) for x, y in status["waypoints"]],
        status["durations_s"],
        scenario.rate_hz,
        scenario.zone.as_rule(),
        status.get("time_law", QUINTIC),
        scenario.min_authority,
        status.get("blend_radius", RESTS),
    )
