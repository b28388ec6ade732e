"""Checks a motion before the robot makes it, finds where it crosses the Type 2 locus and sizes the blending zones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from scipy.optimize import brentq

from fivebar_control.model.geometry import reach_margin
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.singularity import (
    inverse_condition,
    inverse_condition_rate,
    parallel_svd,
)
from fivebar_control.model.state import State
from fivebar_control.trajectory.criterion import criterion_law
from fivebar_control.trajectory.path import Path, Segment
from fivebar_description.interface import NANOSECONDS
from fivebar_description.parameters import FiveBar, LegParameters
from fivebar_description.strict_yaml import InputError

MIN_AUTHORITY = 0.3
"""Least |n . v1| at a crossing: below it the direction across the path is nearly the uncontrollable t_s."""

MIN_ZONE_SAMPLES = 10
"""A ballistic blending zone holds at least this many samples with sigma = 1."""

TYPE_1_CLEARANCE = 1e-4
"""Least distance (m) between a path and the Type 1 boundary."""

SEARCH_STEPS = 400
"""Points per segment at which the sign of det A is looked at; two crossings closer than that count as none."""


class PlanRefused(InputError):
    """The motion cannot be made; says where and why."""


QUINTIC, CRITERION = "quintic", "criterion"
TIME_LAWS = (QUINTIC, CRITERION)
"""How the reference passes along a segment: by the fifth-order polynomial, which knows nothing of the locus (4.2), or
so that the dynamic criterion holds at the crossing."""


class ZoneRule(NamedTuple):
    """How wide a blending zone is.

    With `epsilon` None (ballistic) each crossing gets eps = T_b |dkappa/dt| / 2 from the reference's speed there, so
    that sigma = 1 lasts about `duration` T_b (s). A number is a fixed epsilon for all crossings, as in the thesis.
    """

    duration: float = 0.040
    epsilon: float | None = None


class Crossing(NamedTuple):
    """One planned crossing of the Type 2 locus.

    Attributes:
        segment: number of the path segment.
        time: when the reference is on the locus (s since sample 0).
        x, y: where (m).
        authority: |n . v1|, how well the path's normal can be controlled there.
        kappa_rate: |d kappa / dt| of the reference there (1/s).
        epsilon: half width of the blending zone in kappa.
    """

    segment: int
    time: float
    x: float
    y: float
    authority: float
    kappa_rate: float
    epsilon: float


class Plan(NamedTuple):
    """A checked motion in one working mode, with its crossings in order of time."""

    path: Path
    crossings: tuple[Crossing, ...]
    mode1: int
    mode2: int
    zone_time: float
    """Time (s) for which sigma is meant to be 1 at a crossing, under the ballistic rule."""

    def epsilon_at(self, t: float) -> float:
        """Return the zone width that holds at time t (s): that of the crossing nearest in time, 0 without one."""
        if not self.crossings:
            return 0.0
        return min(self.crossings, key=lambda crossing: abs(crossing.time - t)).epsilon


def plan_motion(
    robot: FiveBar,
    working_mode: Sequence[int],
    waypoints: Sequence[tuple[float, float]],
    durations: Sequence[float],
    rate_hz: int,
    rule: ZoneRule,
    time_law: str = QUINTIC,
) -> Plan:
    """Check a rest-to-rest motion through waypoints (m) with one duration (s) per segment.

    With the time law "criterion", a segment between two assembly modes meets the dynamic criterion where it crosses.

    Raises:
        PlanRefused: malformed waypoints, durations or rate; a point out of reach; a segment that meets Type 1; a
            crossing along the uncontrollable direction; a rest point inside a blending zone; a segment that cannot
            meet the dynamic criterion where that is asked for.
    """
    _refuse_malformed(working_mode, waypoints, durations, rate_hz, rule)
    segments = list(Path.through(waypoints, durations).segments)
    for number, segment in enumerate(segments, start=1):
        for leg_number, leg in enumerate((robot.leg1, robot.leg2), start=1):
            _refuse_unreachable(segment, number, leg, leg_number)
    mode1, mode2 = working_mode
    fractions = [_locus_fractions(robot, mode1, mode2, segment) for segment in segments]
    if time_law == CRITERION:
        segments = [
            _meeting_criterion(segment, number, crossed)
            for number, (segment, crossed) in enumerate(zip(segments, fractions, strict=True), start=1)
        ]
    zone_time = max(rule.duration, MIN_ZONE_SAMPLES / rate_hz)
    crossings = tuple(
        _crossing(robot, mode1, mode2, segment, index, s, zone_time, rule.epsilon)
        for index, (segment, crossed) in enumerate(zip(segments, fractions, strict=True))
        for s in crossed
    )
    plan = Plan(Path(segments), crossings, mode1, mode2, zone_time)
    _refuse_rest_in_zone(robot, plan, waypoints)
    return plan


def _refuse_malformed(
    working_mode: Sequence[int],
    waypoints: Sequence[tuple[float, float]],
    durations: Sequence[float],
    rate_hz: int,
    rule: ZoneRule,
) -> None:
    if len(working_mode) != 2 or any(mode not in (-1, 1) for mode in working_mode):
        raise PlanRefused(f"working_mode: {list(working_mode)}: expected two signs, each +1 or -1")
    if len(waypoints) < 2:
        raise PlanRefused(f"waypoints: {len(waypoints)} given: expected at least two")
    for number, (x, y) in enumerate(waypoints, start=1):
        if not (math.isfinite(x) and math.isfinite(y)):
            raise PlanRefused(f"waypoint {number}: ({x}, {y}): expected finite coordinates in m")
    for number, (start, end) in enumerate(pairwise(waypoints), start=1):
        if tuple(start) == tuple(end):
            raise PlanRefused(f"segment {number}: both ends are {_place(*start)}: expected two different waypoints")
    if len(durations) != len(waypoints) - 1:
        raise PlanRefused(
            f"segment_duration: {len(durations)} given for {len(waypoints) - 1} segments: expected one per segment"
        )
    for number, duration in enumerate(durations, start=1):
        if not (math.isfinite(duration) and duration > 0.0):
            raise PlanRefused(f"segment {number}: duration {duration} s: expected a positive number of seconds")
    if rate_hz <= 0 or NANOSECONDS % rate_hz != 0:
        raise PlanRefused(f"rate_hz: {rate_hz}: expected a rate that divides 1e9, so that stamps are whole nanoseconds")
    if rule.epsilon is not None and not 0.0 < rule.epsilon < 0.5:
        raise PlanRefused(f"zone.epsilon: {rule.epsilon}: expected a number between 0 and 0.5")
    if not (math.isfinite(rule.duration) and rule.duration > 0.0):
        raise PlanRefused(f"zone duration: {rule.duration} s: expected a positive number of seconds")


def _refuse_unreachable(segment: Segment, number: int, leg: LegParameters, leg_number: int) -> None:
    """Raise where a leg cannot follow a segment: its reach is a ring around its base."""
    nearest = _nearest_point(segment, leg.base_x)
    ends = ((segment.start_x, segment.start_y), (segment.end_x, segment.end_y))
    for x, y in (*ends, nearest):
        margin = reach_margin(leg, x, y)
        if margin < 0.0:
            raise PlanRefused(
                f"segment {number}: {_place(x, y)} is out of reach of leg {leg_number} by {-margin * 1e3:.2f} mm"
            )
        if margin < TYPE_1_CLEARANCE:
            raise PlanRefused(
                f"segment {number}: meets the Type 1 singularity of leg {leg_number} at {_place(x, y)}"
                f" ({margin * 1e3:.3f} mm from its boundary, expected at least {TYPE_1_CLEARANCE * 1e3} mm)"
            )


def _nearest_point(segment: Segment, base_x: float) -> tuple[float, float]:
    dx, dy = segment.end_x - segment.start_x, segment.end_y - segment.start_y
    along = ((base_x - segment.start_x) * dx - segment.start_y * dy) / (dx * dx + dy * dy)
    s = min(1.0, max(0.0, along))
    return segment.start_x + dx * s, segment.start_y + dy * s


def _state_on(robot: FiveBar, mode1: int, mode2: int, segment: Segment, s: float) -> State:
    x = segment.start_x + (segment.end_x - segment.start_x) * s
    y = segment.start_y + (segment.end_y - segment.start_y) * s
    return state_from_platform(robot, mode1, mode2, x, y, 0.0, 0.0)


def _locus_fractions(robot: FiveBar, mode1: int, mode2: int, segment: Segment) -> list[float]:
    """Return the fractions of the way along a segment at which det A changes its sign."""

    def assembly(s: float) -> float:
        return det_a(_state_on(robot, mode1, mode2, segment, s))

    grid = [step / SEARCH_STEPS for step in range(SEARCH_STEPS + 1)]
    values = [assembly(s) for s in grid]
    return [
        float(brentq(assembly, grid[step], grid[step + 1], xtol=1e-15))
        for step in range(SEARCH_STEPS)
        if (values[step] > 0.0) != (values[step + 1] > 0.0)
    ]


def _meeting_criterion(segment: Segment, number: int, crossed: list[float]) -> Segment:
    if not crossed:
        return segment
    if len(crossed) > 1:
        raise PlanRefused(
            f"segment {number}: crosses the Type 2 locus {len(crossed)} times: expected at most one crossing per"
            " segment to meet the dynamic criterion"
        )
    law = criterion_law(crossed[0])
    if law is None:
        raise PlanRefused(
            f"segment {number}: crosses the Type 2 locus after {crossed[0]:.0%} of its way: no polynomial that only"
            " goes forwards meets the dynamic criterion so near an end"
        )
    return segment._replace(time_law=law.__call__)


def _crossing(
    robot: FiveBar,
    mode1: int,
    mode2: int,
    segment: Segment,
    index: int,
    s: float,
    zone_time: float,
    fixed_epsilon: float | None,
) -> Crossing:
    time = segment.start_time + _time_fraction(segment, s) * segment.duration
    reference = segment.at(time)
    state = state_from_platform(robot, mode1, mode2, reference.x, reference.y, reference.vx, reference.vy)
    svd = parallel_svd(state)
    line = segment.line()
    authority = abs(line.direction_y * svd.v_x - line.direction_x * svd.v_y)
    if authority < MIN_AUTHORITY:
        raise PlanRefused(
            f"segment {index + 1}: where it crosses the Type 2 locus, at {_place(reference.x, reference.y)}, the"
            f" direction across the path is uncontrollable: |n.v1| = {authority:.2f}, expected at least {MIN_AUTHORITY}"
        )
    kappa_rate = inverse_condition_rate(state)
    epsilon = fixed_epsilon if fixed_epsilon is not None else 0.5 * zone_time * kappa_rate
    return Crossing(index, time, reference.x, reference.y, authority, kappa_rate, epsilon)


def _time_fraction(segment: Segment, s: float) -> float:
    """Return the fraction of a segment's duration after which it has gone the fraction s of its way."""
    return float(brentq(lambda u: segment.time_law(u)[0] - s, 0.0, 1.0, xtol=1e-15))


def _refuse_rest_in_zone(robot: FiveBar, plan: Plan, waypoints: Sequence[tuple[float, float]]) -> None:
    widest = max((crossing.epsilon for crossing in plan.crossings), default=0.0)
    for number, (x, y) in enumerate(waypoints, start=1):
        kappa = inverse_condition(state_from_platform(robot, plan.mode1, plan.mode2, x, y, 0.0, 0.0))
        if kappa < max(2.0 * widest, 1e-6):
            raise PlanRefused(
                f"waypoint {number}: a rest at {_place(x, y)} is inside the blending zone of the Type 2 locus:"
                f" 1/cond(A) = {kappa:.4f}, expected at least {2.0 * widest:.4f}"
            )


def _place(x: float, y: float) -> str:
    return f"({x:.4f}, {y:.4f}) m"
