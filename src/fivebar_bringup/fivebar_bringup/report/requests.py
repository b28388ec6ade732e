"""The plan of a run that took requests: its own motion, and those that were asked for, when they were made."""

from __future__ import annotations

from typing import Any

from fivebar_bringup.errors import BagError
from fivebar_bringup.recorded.bag.recording import Recording
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.plan_along import plan_along
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.path import AnySegment, Path
from fivebar_control.trajectory.planner import QUINTIC, Crossing, Plan, plan_motion
from fivebar_control.trajectory.rounded import RESTS
from fivebar_control.trajectory.spline import Knot, SplineSegment
from fivebar_description.interface import GOAL_STATUS, JOINT_STATES, PROGRAM_STATUS
from fivebar_description.parameters import laden
from fivebar_description.status_texts import read_goal_status

MOVES = {"first_sample", "waypoints", "durations_s"}
"""Fields without which a status does not say how the robot moved."""

CHANGES = ("stopping", "pausing", "resumed")
"""States of a motion under way that is changed."""


def plan_with_requests(recording: Recording, scenario: Scenario) -> Plan:
    """Return what a run was to do; with requests or a program that is also to rest as long as it is recorded.

    Raises:
        BagError: the recorded statuses of requests cannot be read.
        InputError: the scenario's motion is refused.
    """
    plan = scenario.plan()
    asked = recording.count(GOAL_STATUS) > 0
    if not (asked or recording.count(PROGRAM_STATUS) > 0):
        return plan
    try:
        statuses = recording.read_texts(GOAL_STATUS, read_goal_status, needed=False) if asked else []
        moved = [status for status in statuses if status["state"] in CHANGES or status.keys() >= MOVES]
        segments: list[AnySegment] = list(plan.path.segments)
        crossings = list(plan.crossings)
        ahead: list[Crossing] = []
        motion_begin = 0.0
        for status in moved:
            begin = status["first_sample"] / scenario.rate_hz
            if status["state"] == "resumed":
                # from the beginning that the motion would have had without its rest
                late = begin + 0.5 * status["rising_s"] - status["path_time_s"] - motion_begin
                crossings += [crossing._replace(time=crossing.time + late) for crossing in ahead]
                motion_begin = begin
                continue
            if status["state"] in CHANGES:
                # it does not stop near the locus: what is still ahead is not crossed, or later
                ahead = [crossing for crossing in crossings if crossing.time >= begin]
                crossings = [crossing for crossing in crossings if crossing.time < begin]
                continue
            motion_begin = begin
            motion = _requested(scenario, plan, status)
            crossings += [
                crossing._replace(segment=crossing.segment + len(segments), time=crossing.time + begin)
                for crossing in motion.crossings
            ]
            segments += [
                segment._replace(start_time=segment.start_time + begin)
                for segment in motion.path.segments
                if not isinstance(segment, JointSegment)
            ]
    except (ValueError, KeyError, TypeError) as error:
        raise BagError(recording.path, f"/{GOAL_STATUS.name}: is not the status of a request: {error}") from error
    numbers = recording.samples(JOINT_STATES, scenario.rate_hz)
    last = int(numbers.max()) / scenario.rate_hz if numbers.size else 0.0
    return plan._replace(path=Path(segments, last), crossings=tuple(crossings))


def _requested(scenario: Scenario, plan: Plan, status: dict[str, Any]) -> Plan:
    """Return the motion of a status as the planner made it, which knew what the platform carried."""
    if "knots" in status:
        knots = tuple(Knot(*map(float, values)) for values in status["knots"])
        segment = SplineSegment(knots, scenario.five_bar(), status.get("assembly_mode", 0))
        return plan_along(scenario.five_bar(), Path([segment]), (plan.mode1, plan.mode2), scenario.rate_hz)
    return plan_motion(
        laden(scenario.five_bar(), status.get("payload_kg", 0.0)),
        (plan.mode1, plan.mode2),
        [(x, y) for x, y in status["waypoints"]],
        status["durations_s"],
        scenario.rate_hz,
        scenario.zone.as_rule(),
        status.get("time_law", QUINTIC),
        scenario.min_authority,
        status.get("blend_radius", RESTS),
    )
