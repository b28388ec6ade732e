# SPDX-License-Identifier: Apache-2.0
"""Motions that meet Type 1: rests on the boundary of a leg's reach, and changes of working mode through it.

Every waypoint has a working mode of its own. A segment on which that changes, or that begins or ends on the boundary,
is planned in the motors' angles; the others are straight.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import NamedTuple

from fivebar_control.model.geometry import leg_angles, reach_margin, wrap
from fivebar_control.model.kinematics import state_from_motors
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import State, WorkingMode
from fivebar_control.root_search import zero_between
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.path import AnySegment, Segment
from fivebar_control.trajectory.refusal import PlanRefused, out_of_reach, place
from fivebar_description.parameters import FiveBar, LegParameters

TYPE_1_CLEARANCE = 1e-4
"""Least distance (m) of a straight segment from the Type 1 boundary; a rest nearer than that is taken to be on it."""

LEAST_KAPPA = 0.1
"""Least 1/cond(A) on a segment that is planned in the motors' angles: at Type 2 they do not fix the platform."""

MODE_CHANGE_SINE = 0.05
"""|sin q_i2| from which on a leg counts as on one side of Type 1: a rest on the boundary is on neither."""

ROUNDING = 1e-6
"""|sin q_i2| below which a rest is on the boundary."""

STEPS = 400
"""Points per segment at which such a motion is sampled."""


class Meeting(NamedTuple):
    """One planned moment at which a leg is stretched or folded: its number, the time (s) and the place (m)."""

    leg: int
    time: float
    x: float
    y: float


class Rest(NamedTuple):
    """A waypoint: place (m), motor angles (rad), and which legs are stretched there."""

    x: float
    y: float
    q11: float
    q21: float
    stretched: tuple[int, ...]


def rest_at(robot: FiveBar, mode: WorkingMode, number: int, x: float, y: float) -> Rest:
    """Return a waypoint in a working mode, on the Type 1 boundary if it is within `TYPE_1_CLEARANCE` of it.

    Raises:
        PlanRefused: it is out of reach, a leg is folded there, or both legs are stretched.
    """
    margins = [reach_margin(leg, x, y) for leg in (robot.leg1, robot.leg2)]
    stretched = tuple(leg for leg, margin in enumerate(margins, start=1) if abs(margin) < TYPE_1_CLEARANCE)
    for leg, margin in enumerate(margins, start=1):
        if margin <= -TYPE_1_CLEARANCE:
            raise PlanRefused(f"waypoint {number}: {out_of_reach((robot.leg1, robot.leg2)[leg - 1], leg, x, y)}")
    if len(stretched) == 2:
        raise PlanRefused(f"waypoint {number}: both legs are stretched at {place(x, y)}: expected at most one")
    if stretched:
        x, y = _onto_boundary((robot.leg1, robot.leg2)[stretched[0] - 1], number, x, y)
    q11, q21 = (
        math.atan2(y, x - leg.base_x) if number_of_leg in stretched else leg_angles(leg, sign, x, y)[0]
        for number_of_leg, leg, sign in zip((1, 2), (robot.leg1, robot.leg2), mode, strict=True)
    )
    return Rest(x, y, q11, q21, stretched)


def _onto_boundary(leg: LegParameters, number: int, x: float, y: float) -> tuple[float, float]:
    reach = leg.proximal + leg.distal
    distance = math.hypot(x - leg.base_x, y)
    if reach - distance > TYPE_1_CLEARANCE:
        raise PlanRefused(f"waypoint {number}: a leg is folded at {place(x, y)}: expected a stretched one")
    return leg.base_x + (x - leg.base_x) * reach / distance, y * reach / distance


def segments_between(
    robot: FiveBar, modes: Sequence[WorkingMode], waypoints: Sequence[tuple[float, float]], durations: Sequence[float]
) -> list[Segment | JointSegment]:
    """Return one segment per pair of waypoints.

    Raises:
        PlanRefused: a waypoint is impossible, or the motors cannot go from one to the next without meeting Type 2.
    """
    rests = [
        rest_at(robot, mode, number, x, y)
        for number, (mode, (x, y)) in enumerate(zip(modes, waypoints, strict=True), start=1)
    ]
    segments: list[Segment | JointSegment] = []
    time = 0.0
    for number, (((a, mode_a), (b, mode_b)), duration) in enumerate(
        zip(pairwise(zip(rests, modes, strict=True)), durations, strict=True), start=1
    ):
        if (a.x, a.y, a.q11, a.q21) == (b.x, b.y, b.q11, b.q21):
            raise PlanRefused(f"segment {number}: both ends are {place(a.x, a.y)}: expected two different waypoints")
        if mode_a == mode_b and not a.stretched and not b.stretched:
            segments.append(Segment(a.x, a.y, b.x, b.y, time, duration))
        else:
            segments.append(_by_motors(robot, number, a, b, time, duration))
        time += duration
    return segments


def _by_motors(robot: FiveBar, number: int, start: Rest, end: Rest, time: float, duration: float) -> JointSegment:
    def gap(assembly: int, rest: Rest) -> float:
        state = state_from_motors(robot, assembly, rest.q11, rest.q21, 0.0, 0.0)
        return math.hypot(state.x - rest.x, state.y - rest.y)

    assembly = 1 if gap(1, start) < gap(-1, start) else -1
    if gap(assembly, end) > gap(-assembly, end):
        raise PlanRefused(
            f"segment {number}: {place(start.x, start.y)} and {place(end.x, end.y)} are in different assembly modes:"
            " a segment that meets Type 1 cannot cross the Type 2 locus too"
        )
    turns = wrap(end.q11 - start.q11), wrap(end.q21 - start.q21)
    segment = JointSegment(robot, assembly, start.q11, start.q21, *turns, time, duration)
    last = start.x, start.y
    for step in range(STEPS + 1):
        state = segment.state_at(time + duration * step / STEPS)
        # an open loop gives NaN, which is not above the limit
        if not inverse_condition(state) >= LEAST_KAPPA:
            raise PlanRefused(
                f"segment {number}: planned in the motors' angles it comes too near to the Type 2 locus after"
                f" {place(*last)}: 1/cond(A) is expected to be at least {LEAST_KAPPA}"
            )
        last = state.x, state.y
    return segment


def meetings_of(segment: JointSegment) -> list[Meeting]:
    """Return when and where a leg is stretched or folded on a segment: on the way, or at its end."""

    def sine(t: float, leg: int) -> float:
        return _sines(segment.state_at(t))[leg - 1]

    times = [segment.start_time + segment.duration * step / STEPS for step in range(STEPS + 1)]
    meetings = []
    for leg in (1, 2):
        values = [sine(t, leg) for t in times]
        at_end = [times[-1]] if abs(values[-1]) < ROUNDING else []
        # the sign of a rest on the boundary is that of rounding
        values[0] = values[1] if abs(values[0]) < ROUNDING else values[0]
        values[-1] = values[-2] if at_end else values[-1]
        on_way = [
            zero_between(partial(sine, leg=leg), before, after, 1e-12)
            for (before, after), (v, w) in zip(pairwise(times), pairwise(values), strict=True)
            if (v > 0.0) != (w > 0.0)
        ]
        for t in on_way + at_end:
            state = segment.state_at(t)
            meetings.append(Meeting(leg, t, state.x, state.y))
    return meetings


def planned_mode_changes(segments: Sequence[AnySegment]) -> int:
    """Return how often the working mode changes on segments; straight ones keep it."""
    return working_mode_changes(
        [
            _sines(segment.state_at(segment.start_time + segment.duration * step / STEPS))
            for segment in segments
            if isinstance(segment, JointSegment)
            for step in range(STEPS + 1)
        ]
    )


def working_mode_changes(sines: Sequence[Sequence[float]]) -> int:
    """Return how often a leg went from one side of Type 1 to the other, given (sin q12, sin q22) over time."""
    changes = 0
    for leg in (0, 1):
        sides = [row[leg] > 0.0 for row in sines if abs(row[leg]) >= MODE_CHANGE_SINE]
        changes += sum(before != after for before, after in pairwise(sides))
    return changes


def _sines(state: State) -> tuple[float, float]:
    return state.leg1.sin_q2, state.leg2.sin_q2
