# SPDX-License-Identifier: Apache-2.0
"""What the planner makes of motions that may meet Type 1, and what it refuses."""

from __future__ import annotations

import math

import pytest

from fivebar_control.model.geometry import reach_margin
from fivebar_control.trajectory.joint_segment import JointSegment
from fivebar_control.trajectory.path import Segment
from fivebar_control.trajectory.planner import PlanRefused, plan_motion
from fivebar_control.trajectory.type1 import working_mode_changes
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar

A, BEYOND, BELOW = (0.0, 0.15), (0.03, 0.1), (0.04, -0.02)
BOUNDARY = (0.049, 0.144)
OUT, IN = (1, -1), (-1, -1)

Point = tuple[float, float]
Mode = tuple[int, int]


def plan(robot: FiveBar, *stops: tuple[Point, Mode], durations: tuple[float, ...] | None = None):  # type: ignore[no-untyped-def]
    signs = [sign for _, mode in stops for sign in mode]
    points = [point for point, _ in stops]
    return plan_motion(robot, signs, points, durations or (1.0,) * (len(stops) - 1), 500, ZoneRule())


def test_a_change_of_working_mode_is_planned_in_the_motors_angles(dextar: FiveBar) -> None:
    found = plan(dextar, (A, OUT), (BEYOND, IN), (BELOW, IN), durations=(1.0, 2.0))
    first, second = found.path.segments
    assert isinstance(first, JointSegment)
    assert isinstance(second, Segment)
    assert found.working_mode_changes == 1
    (meeting,) = found.meetings
    assert meeting.leg == 1
    assert abs(reach_margin(dextar.leg1, meeting.x, meeting.y)) < 1e-9
    assert 0.0 < meeting.time < 1.0
    # the other working mode has a Type 2 locus of its own
    (crossing,) = found.crossings
    assert crossing.segment == 1
    assert crossing.y < 0.05
    assert [found.mode_at(t) for t in (0.0, 0.99, 1.5, 3.0)] == [OUT, IN, IN, IN]


def test_the_motion_seen_in_a_mirror_is_the_motion_of_the_other_assembly_mode(dextar: FiveBar) -> None:
    """Mirrored in the axis of the motors all angles change their sign, and so does the assembly mode."""
    above = plan(dextar, (A, OUT), (BOUNDARY, OUT), (BEYOND, IN), durations=(1.0, 2.0))
    below = plan(
        dextar,
        ((A[0], -A[1]), (-1, 1)), ((BOUNDARY[0], -BOUNDARY[1]), (-1, 1)), ((BEYOND[0], -BEYOND[1]), (1, 1)),
        durations=(1.0, 2.0),
    )  # fmt: skip
    for t in (0.0, 0.3, 0.9, 1.6, 2.2, 3.0):
        one, other = above.path.at(t), below.path.at(t)
        assert (other.x, -other.y, other.vx, -other.vy) == pytest.approx(one[:4], abs=1e-9)
    for segments, assembly in ((above.path.segments, 1), (below.path.segments, -1)):
        assert [segment.assembly for segment in segments if isinstance(segment, JointSegment)] == [assembly] * 2


def test_a_rest_on_the_boundary_changes_nothing_unless_the_next_segment_does(dextar: FiveBar) -> None:
    back = plan(dextar, (A, OUT), (BOUNDARY, OUT), (A, OUT))
    assert back.working_mode_changes == 0
    assert [meeting.time for meeting in back.meetings] == [1.0]
    through = plan(dextar, (A, OUT), (BOUNDARY, OUT), (BEYOND, IN))
    assert through.working_mode_changes == 1


def test_a_waypoint_near_the_boundary_is_put_onto_it(dextar: FiveBar) -> None:
    found = plan(dextar, (A, OUT), ((0.04895, 0.14401), OUT), (A, OUT))
    x, y = found.path.at(1.0)[:2]
    assert reach_margin(dextar.leg1, x, y) == pytest.approx(0.0, abs=1e-12)
    assert math.dist((x, y), (0.04895, 0.14401)) < 1e-4


def test_one_working_mode_for_every_waypoint_is_the_motion_without(dextar: FiveBar) -> None:
    """As long as it meets no Type 1."""
    points, times = (A, (0.0, 0.02), A), (1.0, 1.0)
    one = plan_motion(dextar, OUT, points, times, 500, ZoneRule())
    each = plan_motion(dextar, OUT * 3, points, times, 500, ZoneRule())
    assert each.crossings == one.crossings
    assert [each.path.at(t) for t in (0.3, 1.7)] == [one.path.at(t) for t in (0.3, 1.7)]
    assert (each.meetings, each.working_mode_changes) == ((), 0)


@pytest.mark.parametrize(
    ("stops", "reason"),
    [
        (((A, OUT), (BELOW, IN)), "different assembly modes"),
        (((A, OUT), ((0.15, 0.15), OUT)), "waypoint 2: .* is out of reach of leg 1"),
        (((A, OUT), ((0.0, 0.17004), OUT)), "both legs are stretched"),
        (((A, OUT), ((-0.059, 0.00005), OUT)), "a leg is folded"),
        (((A, OUT), (A, OUT)), "expected two different waypoints"),
        (((BOUNDARY, OUT), (BOUNDARY, OUT)), "expected two different waypoints"),
    ],
)
def test_impossible_motions_are_refused(stops: tuple[tuple[Point, Mode], ...], reason: str, dextar: FiveBar) -> None:
    with pytest.raises(PlanRefused, match=reason):
        plan(dextar, *stops)


def test_without_a_working_mode_per_waypoint_type_1_is_refused_as_ever(dextar: FiveBar) -> None:
    with pytest.raises(PlanRefused, match="meets the Type 1 singularity of leg 1"):
        plan_motion(dextar, OUT, (A, BOUNDARY), (1.0,), 500, ZoneRule())
    with pytest.raises(PlanRefused, match="two for each of the 2 waypoints"):
        plan_motion(dextar, (1, -1, 1), (A, BOUNDARY), (1.0,), 500, ZoneRule())


def test_changes_are_counted_from_side_to_side() -> None:
    """A leg that trembles on the boundary has not changed its working mode."""
    tremble = [(0.9, 0.5), (0.3, 0.5), (0.01, 0.5), (-0.01, 0.5), (0.02, 0.5), (0.4, 0.5)]
    assert working_mode_changes(tremble) == 0
    assert working_mode_changes([*tremble, (-0.01, 0.4), (-0.3, -0.5)]) == 2
    assert working_mode_changes([(math.nan, math.nan), (0.5, 0.5)]) == 0
