# SPDX-License-Identifier: Apache-2.0
"""Checks a motion before the robot makes it, finds where it crosses the Type 2 locus and sizes the blending zones."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise
from typing import NamedTuple

from fivebar_control.laws.law import MIN_AUTHORITY
from fivebar_control.model.geometry import reach_margin
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.singularity import (
    DistalLinks,
    distal_links,
    inverse_condition,
    inverse_condition_rate,
    parallel_svd,
)
from fivebar_control.model.state import WorkingMode
from fivebar_control.root_search import minimum_between
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.path import (
    AnySegment,
    Path,
    Segment,
    grid_along,
    locus_fractions,
    state_on,
    way_of,
)
from fivebar_control.trajectory.refusal import PlanRefused as PlanRefused
from fivebar_control.trajectory.refusal import out_of_reach, place
from fivebar_control.trajectory.rounded import RESTS, RoundedSegment, radii_at, stretches
from fivebar_control.trajectory.time_laws import QUINTIC, Untimed, timed_by
from fivebar_control.trajectory.type1 import (
    TYPE_1_CLEARANCE,
    Meeting,
    meetings_of,
    planned_mode_changes,
    segments_between,
)
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.interface import NANOSECONDS
from fivebar_description.parameters import FiveBar, LegParameters

LONGEST_SEGMENT = 3600.0
"""Longest duration (s) of a segment: what plans and judges a motion looks at every sample of it."""

ON_LOCUS = 1e-6
"""Below this 1/cond(A) a rest is on the Type 2 locus."""


class Crossing(NamedTuple):
    """One planned crossing of the Type 2 locus.

    Attributes:
        segment: number of the path segment.
        time: when the reference is on the locus (s since sample 0).
        x, y: where (m).
        authority: |n . v1|, how well the path's normal can be controlled there.
        kappa_rate: |d kappa / dt| of the reference there (1/s).
        epsilon: half width of the blending zone in kappa.
        distal_links: the branch of the locus. Where they are folded, the elbows pass each other.
    """

    segment: int
    time: float
    x: float
    y: float
    authority: float
    kappa_rate: float
    epsilon: float
    distal_links: DistalLinks


class Plan(NamedTuple):
    """A checked motion with its crossings in order of time.

    Attributes:
        path: the reference.
        crossings: of the Type 2 locus.
        mode: working mode at the start.
        zone_time: time (s) for which sigma is meant to be 1 at a crossing, under the ballistic rule.
        modes: working mode of each straight segment, () where it is that of the start throughout.
        meetings: with Type 1, in order of time.
        working_mode_changes: how often a leg goes through Type 1.
    """

    path: Path
    crossings: tuple[Crossing, ...]
    mode: WorkingMode
    zone_time: float
    modes: tuple[WorkingMode, ...] = ()
    meetings: tuple[Meeting, ...] = ()
    working_mode_changes: int = 0

    def mode_at(self, t: float) -> WorkingMode:
        """Return the working mode at time t (s)."""
        if not self.modes:
            return self.mode
        index = self.path.segment_index(t)
        segment = self.path.segments[index]
        return segment.mode_at(t) if isinstance(segment, JointSegment) else self.modes[index]

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
    min_authority: float = MIN_AUTHORITY,
    blend_radius: Sequence[float] = RESTS,
) -> Plan:
    """Check a rest-to-rest motion through waypoints (m) with one duration (s) per segment.

    The working mode is a pair of signs, or one pair after the other for every waypoint. Only with the latter may the
    motion meet Type 1: a waypoint within 0.1 mm of the boundary is a rest on it, and a segment there or between two
    working modes is planned in the motors' angles. With the time law "criterion", a segment between two assembly modes
    meets the dynamic criterion where it crosses. `min_authority` is the least |n . v1| at a crossing; a controller that
    does not hold the path by its normal needs none, and has no blending zones. `blend_radius` (m) is one number, or one
    for each waypoint between the first and the last: with 0 the motion rests there, else it goes round the corner, and
    both segments become one that takes the sum of their durations.

    Raises:
        PlanRefused: malformed waypoints, durations or rate; a point out of reach; a segment that meets Type 1; a
            crossing along the uncontrollable direction; a rest point inside a blending zone; a segment too short for
            its zones, or that cannot meet the dynamic criterion where that is asked for.
    """
    _refuse_malformed(working_mode, waypoints, durations, rate_hz, rule)
    modes = _modes_of_waypoints(working_mode, len(waypoints))
    radii = radii_at(blend_radius, len(waypoints) - 2)
    if any(radii) and len(working_mode) > 2:
        raise PlanRefused("blend_radius: a motion that may meet Type 1 rests at each waypoint: expected 0")
    segments: list[AnySegment] = (
        _rounded(waypoints, durations, radii)
        if len(working_mode) == 2
        else [*segments_between(robot, modes, waypoints, durations)]
    )
    zone_time = rule.lasts(rate_hz)
    crossings: list[Crossing] = []
    for index, (segment, mode) in enumerate(zip(segments, modes[: len(segments)], strict=True)):
        if not isinstance(segment, Segment | RoundedSegment):
            continue
        for leg_number, leg in enumerate((robot.leg1, robot.leg2), start=1):
            _refuse_unreachable(segment, index + 1, leg, leg_number)
        fractions = locus_fractions(robot, mode, way_of(segment))
        timed = timed_by(time_law, Untimed(robot, mode, segment, index + 1, fractions))
        segments[index] = timed
        met = [crossing_at(robot, mode, timed, index, s, zone_time, rule.epsilon) for s in fractions]
        _refuse_uncontrollable(met, min_authority)
        if min_authority > 0.0:
            _refuse_zone_everywhere(timed.duration, index + 1, met, zone_time)
            if isinstance(timed, RoundedSegment):
                _refuse_zone_in_corner(robot, mode, timed, index + 1, met)
        crossings += met
    # a law that holds the path by no normal is blended with none: it has no zones
    rests = [number for number, radius in enumerate((0.0, *radii, 0.0)) if radius == 0.0]
    _refuse_rest_in_zone(robot, crossings if min_authority > 0.0 else (), modes, waypoints, rests)
    if len(working_mode) == 2:
        return Plan(Path(segments), tuple(crossings), modes[0], zone_time)
    return Plan(
        Path(segments),
        tuple(crossings),
        modes[0],
        zone_time,
        modes=tuple(modes[:-1]),
        meetings=tuple(
            sorted(
                (m for segment in segments if isinstance(segment, JointSegment) for m in meetings_of(segment)),
                key=lambda meeting: meeting.time,
            )
        ),
        working_mode_changes=planned_mode_changes(segments),
    )


def _rounded(
    waypoints: Sequence[tuple[float, float]], durations: Sequence[float], radii: Sequence[float]
) -> list[AnySegment]:
    """Return the segments between rests, rounded where a radius (m) is not 0."""
    straight: list[AnySegment] = list(Path.through(waypoints, durations).segments)
    if not any(radii):
        return straight
    segments: list[AnySegment] = []
    last = 0
    for stretch in stretches(waypoints, durations, radii):
        segments.append(straight[last] if stretch is None else stretch)
        last += 1 if stretch is None else len(stretch.curve.points) - 1
    return segments


def _modes_of_waypoints(working_mode: Sequence[int], count: int) -> list[WorkingMode]:
    pairs = list(zip(working_mode[::2], working_mode[1::2], strict=True))
    return pairs * count if len(pairs) == 1 else pairs


def _refuse_malformed(
    working_mode: Sequence[int],
    waypoints: Sequence[tuple[float, float]],
    durations: Sequence[float],
    rate_hz: int,
    rule: ZoneRule,
) -> None:
    if len(waypoints) < 2:
        raise PlanRefused(f"waypoints: {len(waypoints)} given: expected at least two")
    if len(working_mode) not in (2, 2 * len(waypoints)) or any(mode not in (-1, 1) for mode in working_mode):
        raise PlanRefused(
            f"working_mode: {list(working_mode)}: expected two signs, each +1 or -1, or two for each of the"
            f" {len(waypoints)} waypoints"
        )
    for number, (x, y) in enumerate(waypoints, start=1):
        if not (math.isfinite(x) and math.isfinite(y)):
            raise PlanRefused(f"waypoint {number}: ({x}, {y}): expected finite coordinates in m")
    for number, (start, end) in enumerate(pairwise(waypoints), start=1):
        # between two working modes the same place is two postures
        if tuple(start) == tuple(end) and len(working_mode) == 2:
            raise PlanRefused(f"segment {number}: both ends are {place(*start)}: expected two different waypoints")
    if len(durations) != len(waypoints) - 1:
        raise PlanRefused(
            f"segment_duration: {len(durations)} given for {len(waypoints) - 1} segments: expected one per segment"
        )
    for number, duration in enumerate(durations, start=1):
        if not (math.isfinite(duration) and duration > 0.0):
            raise PlanRefused(f"segment {number}: duration {duration} s: expected a positive number of seconds")
        if duration > LONGEST_SEGMENT:
            raise PlanRefused(f"segment {number}: duration {duration:g} s: expected at most {LONGEST_SEGMENT:g} s")
    if rate_hz <= 0 or NANOSECONDS % rate_hz != 0:
        raise PlanRefused(f"rate_hz: {rate_hz}: expected a rate that divides 1e9, so that stamps are whole nanoseconds")
    if rule.epsilon is not None and not 0.0 < rule.epsilon < 0.5:
        raise PlanRefused(f"zone.epsilon: {rule.epsilon}: expected a number between 0 and 0.5")
    if not (math.isfinite(rule.duration) and rule.duration > 0.0):
        raise PlanRefused(f"zone duration: {rule.duration} s: expected a positive number of seconds")


def _refuse_unreachable(segment: Segment | RoundedSegment, number: int, leg: LegParameters, leg_number: int) -> None:
    """Raise where a leg cannot follow a segment: its reach is a ring around its base."""
    if isinstance(segment, RoundedSegment):
        decisive = [_least_margin(segment, leg)]
    else:
        ends = [(segment.start_x, segment.start_y), (segment.end_x, segment.end_y)]
        decisive = [*ends, _nearest_point(segment, leg.base_x)]
    for x, y in decisive:
        beyond = out_of_reach(leg, leg_number, x, y)
        if beyond is not None:
            raise PlanRefused(f"segment {number}: {beyond}")
        margin = reach_margin(leg, x, y)
        if margin < TYPE_1_CLEARANCE:
            raise PlanRefused(
                f"segment {number}: meets the Type 1 singularity of leg {leg_number} at {place(x, y)}"
                f" ({margin * 1e3:.3f} mm from its boundary, expected at least {TYPE_1_CLEARANCE * 1e3} mm)"
            )


def _nearest_point(segment: Segment, base_x: float) -> tuple[float, float]:
    dx, dy = segment.end_x - segment.start_x, segment.end_y - segment.start_y
    along = ((base_x - segment.start_x) * dx - segment.start_y * dy) / (dx * dx + dy * dy)
    s = min(1.0, max(0.0, along))
    return segment.start_x + dx * s, segment.start_y + dy * s


def _least_margin(segment: RoundedSegment, leg: LegParameters) -> tuple[float, float]:
    """Return the place (m) on a rounded segment at which a leg has the least reach left."""

    def margin(s: float) -> float:
        return reach_margin(leg, *segment.curve.at(s)[:2])

    grid = grid_along(way_of(segment))
    worst = min(range(len(grid)), key=lambda number: margin(grid[number]))
    around = grid[max(worst - 1, 0)], grid[min(worst + 1, len(grid) - 1)]
    refined = minimum_between(margin, *around)[0]
    return segment.curve.at(min((grid[worst], refined), key=margin))[:2]


def _refuse_zone_everywhere(duration: float, number: int, crossings: Sequence[Crossing], zone_time: float) -> None:
    """Raise where a segment is so quick that its zones reach everywhere: 1/cond(A) is 1 at most."""
    edge = 2.0 * max((crossing.epsilon for crossing in crossings), default=0.0)
    if edge > 1.0:
        # at a crossing 1/cond(A) changes in inverse proportion to the duration, and so does the width of a zone
        raise PlanRefused(
            f"segment {number}: a duration of {duration:g} s is too short for the blending zone of the Type 2 locus,"
            f" which takes {1e3 * zone_time:g} ms at a crossing: expected more than {edge * duration:.3g} s"
        )


def _refuse_zone_in_corner(
    robot: FiveBar,
    mode: WorkingMode,
    segment: RoundedSegment,
    number: int,
    crossings: Sequence[Crossing],
) -> None:
    """Raise where a zone reaches into a corner: the constraint law holds the platform to a line, not to a curve."""
    edge = 2.0 * max((crossing.epsilon for crossing in crossings), default=0.0)
    grid = grid_along(segment.curve) if edge > 0.0 else []
    for start, end in segment.curve.corners():
        for s in (s for s in grid if start <= s <= end):
            state = state_on(robot, mode, segment.curve, s)
            if inverse_condition(state) < edge:
                raise PlanRefused(
                    f"segment {number}: the corner at {place(state.x, state.y)} is inside the blending zone of the"
                    f" Type 2 locus: 1/cond(A) = {inverse_condition(state):.4f}, expected at least {edge:.4f}: a"
                    " controller that holds the platform to the path's normal crosses on straight parts only"
                )


def _refuse_uncontrollable(crossings: Sequence[Crossing], min_authority: float) -> None:
    for crossing in crossings:
        if crossing.authority < min_authority:
            raise PlanRefused(
                f"segment {crossing.segment + 1}: where it crosses the Type 2 locus, at"
                f" {place(crossing.x, crossing.y)}, the direction across the path is uncontrollable:"
                f" |n.v1| = {crossing.authority:.2f}, expected at least {min_authority}"
            )


def crossing_at(
    robot: FiveBar,
    mode: WorkingMode,
    segment: Segment | RoundedSegment,
    index: int,
    s: float,
    zone_time: float,
    fixed_epsilon: float | None,
) -> Crossing:
    """Return the crossing at a share of a segment's way, with a zone of a time (s), or of a width in 1/cond(A)."""
    time = segment.time_at(s)
    reference = segment.at(time)
    state = state_from_platform(robot, mode, reference.x, reference.y, reference.vx, reference.vy)
    svd = parallel_svd(state)
    line = segment.line_at(time)
    authority = abs(line.direction_y * svd.v_x - line.direction_x * svd.v_y)
    kappa_rate = inverse_condition_rate(state)
    epsilon = fixed_epsilon if fixed_epsilon is not None else 0.5 * zone_time * kappa_rate
    return Crossing(index, time, reference.x, reference.y, authority, kappa_rate, epsilon, distal_links(state))


def _refuse_rest_in_zone(
    robot: FiveBar,
    crossings: Sequence[Crossing],
    modes: Sequence[WorkingMode],
    waypoints: Sequence[tuple[float, float]],
    rests: Sequence[int],
) -> None:
    """Raise where a rest is in a zone; `rests` are the indices of the waypoints at which the motion rests."""
    widest = max((crossing.epsilon for crossing in crossings), default=0.0)
    for number, mode, (x, y) in ((rest + 1, modes[rest], waypoints[rest]) for rest in rests):
        kappa = inverse_condition(state_from_platform(robot, mode, x, y, 0.0, 0.0))
        if kappa < ON_LOCUS:
            raise PlanRefused(f"waypoint {number}: a rest at {place(x, y)} is on the Type 2 locus")
        if kappa < 2.0 * widest:
            raise PlanRefused(
                f"waypoint {number}: a rest at {place(x, y)} is inside the blending zone of the Type 2 locus:"
                f" 1/cond(A) = {kappa:.4f}, expected at least {2.0 * widest:.4f}"
            )
