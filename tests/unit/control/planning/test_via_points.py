# SPDX-License-Identifier: Apache-2.0
"""Requested motions along via points: round the corner without a rest, at rest where that is asked for, or refused."""

from __future__ import annotations

import math
import pickle
from collections.abc import Sequence

import pytest

from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.planning.course import Course
from fivebar_control.planning.figures import ERROR
from fivebar_control.planning.limits import MotionLimits, motion_limits_of
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.order_planning import plan_order
from fivebar_control.planning.orders import Conditions, PlanningRequest
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.timing import Speed, Timed
from fivebar_control.planning.transfer import Transfer, TransferRefused, plan_transfer
from fivebar_control.planning.via_points import along
from fivebar_control.trajectory.criterion import criterion_residual
from fivebar_control.trajectory.path import Path, Segment
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_control.trajectory.rounded import RESTS, RoundedSegment
from fivebar_control.trajectory.time_laws import OPTIMAL, QUINTIC
from fivebar_description.parameters import FiveBar

RATE_HZ = 500
START, OVER_PARTS, OVER_BIN, GOAL = (0.03, 0.12), (0.03, 0.14), (0.0, 0.14), (0.0, 0.02)
"""Up, across and down through the locus, as for picking and placing."""

IN_CORNER = ((0.0, 0.15), (0.02, 0.075), (0.03, 0.02))
"""The corner holds the crossing."""


def transfer(
    robot: FiveBar,
    points: Sequence[Point],
    radii: Sequence[float] = RESTS,
    duration: float | Speed = Speed.COMFORTABLE,
    controller: str = "unified",
    limits: MotionLimits | None = None,
) -> Transfer:
    follower = default_tuning(CONTROLLERS[controller])
    task = Task(robot, (1, -1), RATE_HZ, follower, motion_limits_of(follower) if limits is None else limits)
    return plan_transfer(task, points[0], points[-1], duration=duration, via=points[1:-1], blend_radius=radii)


def slowest_at(found: Transfer, via: Point, reach: float) -> float:
    """Return the least speed (m/s) of the reference within a distance (m) of a point."""
    path = found.plan.path
    places = (path.at(sample / RATE_HZ) for sample in range(1, path.samples(RATE_HZ)))
    return min(math.hypot(one.vx, one.vy) for one in places if math.dist(one[:2], via) <= reach)


def test_a_course_is_parted_at_its_rests_and_timed_by_its_legs() -> None:
    points = ((0.0, 0.0), (0.01, 0.0), (0.01, 0.02), (0.0, 0.02), (0.0, 0.05))
    course = Course.through(points, (0.002, 0.0, 0.003))
    assert course.between_rests() == [
        Course(points[:3], (0.002,), OPTIMAL),
        Course(points[2:], (0.003,), OPTIMAL),
    ]
    assert Course.through(points).between_rests() == [Course(points[n : n + 2], (), QUINTIC) for n in range(4)]
    assert Course.through(points).shared(8.0) == pytest.approx((8 / 7, 16 / 7, 8 / 7, 24 / 7))
    assert course.sampled(0.7, 100) == (0.1, 0.2, 0.1, 0.3)
    # a leg has a sample at least, and what it gets is taken from another one
    assert Course.through(((0.0, 0.0), (1e-3, 0.0), (0.1, 0.0))).sampled(0.05, 100) == (0.01, 0.04)
    # the one leg of a straight course has its duration as it is
    assert Course.through(points[:2]).sampled(0.1234567, 500) == (0.1234567,)


# the fastest motion with rests has the time law of least torque too
@pytest.mark.parametrize(("speed", "share"), [(Speed.COMFORTABLE, 0.85), (Speed.FASTEST, 0.96)])
def test_round_the_corners_it_never_rests_crosses_by_the_criterion_and_is_quicker(
    dextar: FiveBar, speed: Speed, share: float
) -> None:
    points = (START, OVER_PARTS, OVER_BIN, GOAL)
    found, rests = (transfer(dextar, points, (radius,), speed) for radius in (0.01, 0.0))
    (segment,) = found.plan.path.segments
    assert isinstance(segment, RoundedSegment)
    assert segment.duration == pytest.approx(sum(found.durations), abs=1e-12)
    for duration in found.durations:
        assert duration * RATE_HZ == pytest.approx(round(duration * RATE_HZ), abs=1e-9)
    for via in points[1:-1]:
        assert slowest_at(rests, via, 0.01) < 1e-3
        assert slowest_at(found, via, 0.01) > 0.05
    (crossing,) = found.crossings
    # N, against those of the motion: 0.35 kg and accelerations of some m/s^2
    assert criterion_residual(dextar, (1, -1), found.plan.path.at(crossing.time)) == pytest.approx(0.0, abs=1e-6)
    assert found.speed_at(crossing) > 0.1
    assert rests.course.time_law == (OPTIMAL if speed is Speed.FASTEST else QUINTIC)
    assert sum(found.durations) < share * sum(rests.durations)
    error = found.feasibility.figure(ERROR)
    assert error is not None and error.value < 0.5e-3


def test_corners_save_time_beyond_what_their_time_law_saves(dextar: FiveBar) -> None:
    points, follower = (START, OVER_PARTS, OVER_BIN, GOAL), default_tuning(CONTROLLERS["unified"])
    task = Task(dextar, (1, -1), RATE_HZ, follower, motion_limits_of(follower))
    rests, rounded = (
        sum(found.durations)
        for radius in (0.0, 0.01)
        if isinstance(found := along(task, Course(points, (radius,) * 2, OPTIMAL), Speed.COMFORTABLE), Timed)
    )
    assert rounded < 0.96 * rests


def test_a_corner_may_hold_the_crossing_near_which_no_rest_is_possible(dextar: FiveBar) -> None:
    (via,) = IN_CORNER[1:-1]
    found = transfer(dextar, IN_CORNER, (0.01,))
    (crossing,) = found.plan.crossings
    assert math.dist((crossing.x, crossing.y), via) < 0.01
    assert criterion_residual(dextar, (1, -1), found.plan.path.at(crossing.time)) == pytest.approx(0.0, abs=1e-6)
    assert slowest_at(found, via, 0.01) > 0.1


def test_through_the_locus_and_back_to_where_it_was(dextar: FiveBar) -> None:
    points = ((0.0, 0.15), (-0.03, 0.02), (0.03, 0.02), (0.0, 0.15))
    found = transfer(dextar, points, (0.02,))
    assert len(found.crossings) == 2
    assert found.assembly_start == found.assembly_goal == 1
    for crossing in found.plan.crossings:
        assert criterion_residual(dextar, (1, -1), found.plan.path.at(crossing.time)) == pytest.approx(0.0, abs=1e-6)


def test_it_rests_where_the_radius_is_nought(dextar: FiveBar) -> None:
    points = (START, OVER_PARTS, OVER_BIN, GOAL)
    found = transfer(dextar, points, (0.01, 0.0))
    rounded, straight = found.plan.path.segments
    assert isinstance(rounded, RoundedSegment) and isinstance(straight, Segment)
    assert (straight.start_x, straight.start_y) == OVER_BIN
    assert slowest_at(found, OVER_PARTS, 0.01) > 0.05
    assert slowest_at(found, OVER_BIN, 1e-4) < 1e-2


def test_with_rests_only_it_goes_by_the_same_polynomials_as_without_via_points(dextar: FiveBar) -> None:
    found = transfer(dextar, (START, OVER_BIN, GOAL))
    expected = Path.through(found.waypoints, found.durations)
    assert found.course == Course((START, OVER_BIN, GOAL), (0.0,), QUINTIC)
    assert found.plan.path.segments == expected.segments


def test_the_duration_may_be_asked_for(dextar: FiveBar) -> None:
    points = (START, OVER_PARTS, OVER_BIN, GOAL)
    assert sum(transfer(dextar, points, (0.01,), 1.5).durations) == pytest.approx(1.5)
    possible = r"in 0\.2 s reference torque is .*possible are about 0\.\d+ to \d+\.\d+ s\)"
    with pytest.raises(TransferRefused, match=possible):
        transfer(dextar, points, (0.01,), 0.2)


def test_a_blended_controller_crosses_on_straight_parts_only(dextar: FiveBar) -> None:
    found = transfer(dextar, (START, OVER_BIN, GOAL), (0.01,), controller="multi_cartesian")
    assert isinstance(found.plan.path.segments[0], RoundedSegment)
    with pytest.raises(TransferRefused, match=r"the corner at \(0\.0.*inside the blending zone of the Type 2 locus"):
        transfer(dextar, IN_CORNER, (0.01,), controller="multi_cartesian")


REFUSED = {
    "too wide": (
        ((0.0, 0.15), (0.03, 0.14), (0.03, 0.02)),
        (0.05,),
        r"waypoints 1 and 2: blend radii of 0 and 0\.05 m do not fit on the 0\.03162 m between them,"
        r" \(0\.0000, 0\.1500\) m and \(0\.0300, 0\.1400\) m: expected smaller ones, at most 0\.03162 m together, or"
        r" waypoints further apart; with blend_radius 0, a rest in each of them, it takes 0\.\d+ s",
    ),
    "too wide together": (
        (START, OVER_PARTS, OVER_BIN, GOAL),
        (0.01, 0.025),
        r"waypoints 2 and 3: blend radii of 0\.01 and 0\.025 m do not fit on the 0\.03 m",
    ),
    "reversal": (
        ((0.0, 0.15), (0.0, 0.11), (0.0, 0.14)),
        (0.01,),
        r"waypoint 2: the corner at \(0\.0000, 0\.1100\) m turns by 180 degrees: expected at most 150",
    ),
    "too small": ((START, OVER_BIN, GOAL), (1e-4,), r"expected 0 for a rest, or at least 0\.001 m"),
    "one too many": ((START, OVER_BIN, GOAL), (0.01, 0.01), "2 given for 1 waypoints between the first and the last"),
    "without via points": (
        (START, GOAL),
        (0.01,),
        r"blend_radius: \[0\.01\]: expected with via points",
    ),
    "corner out of reach": (
        ((0.0, 0.15), (0.1, 0.2), (0.05, 0.05)),
        (0.01,),
        r"segment 1: \(.*\) m is out of reach of leg 1 by \d+",
    ),
    "rest on the locus": (((0.0, 0.15), (0.0, 0.08447), GOAL), (0.0,), r"1/cond\(A\) at rest is"),
    "twice the same": ((START, START, GOAL), (0.0,), r"via point 1: the platform is at \(0\.0300, 0\.1200\) m already"),
}


@pytest.mark.parametrize(("points", "radii", "reason"), REFUSED.values(), ids=list(REFUSED))
def test_what_cannot_be_is_refused_with_place_figure_and_remedy(
    points: Sequence[Point], radii: Sequence[float], reason: str, dextar: FiveBar
) -> None:
    with pytest.raises(PlanRefused, match=reason):
        transfer(dextar, points, radii)


def test_what_the_drives_cannot_do_round_the_corner_is_refused_by_the_screen(dextar: FiveBar) -> None:
    weak = motion_limits_of(default_tuning(CONTROLLERS["unified"]), torque=0.3)
    expected = r"by way of \(0\.0300, 0\.1400\) m.*the longest possible duration, reference torque is 0\.\d+ Nm at"
    with pytest.raises(TransferRefused, match=expected):
        transfer(dextar, (START, OVER_PARTS, OVER_BIN, GOAL), (0.01,), limits=weak)


@pytest.mark.parametrize("radius", [0.013, 0.016, 0.019])
def test_a_refusal_speaks_of_loads_only_where_some_are_declared(radius: float, dextar: FiveBar) -> None:
    """Durations that time near the locus bounds, which a plan has up to rounding only."""
    weak = motion_limits_of(default_tuning(CONTROLLERS["unified"]), torque=0.2)
    with pytest.raises(TransferRefused, match=r"the longest possible duration, reference torque is 0\.43\d Nm at"):
        transfer(dextar, IN_CORNER, (radius,), limits=weak)


def test_the_planning_process_hands_out_the_motion_that_was_judged() -> None:
    """Whoever follows it plans nothing: it gets the segments, time law and all."""
    points = (START, OVER_PARTS, OVER_BIN, GOAL)
    order = PlanningRequest(START, (1, -1), GOAL, -1, 0.0, payload=0.1, via=points[1:-1], blend_radius=(0.01, 0.01))
    planned = plan_order(Conditions("dextar", RATE_HZ, 2.0, 50.0), order)
    assert (planned.refused, planned.course.waypoints, planned.course.blend_radius) == ("", points, (0.01, 0.01))
    assert (planned.course.time_law, planned.course.rounded) == (OPTIMAL, True)
    sent, kept = pickle.loads(pickle.dumps(planned)).path(), planned.path()
    assert sent.duration == kept.duration == pytest.approx(sum(planned.durations), abs=1e-12)
    for sample in range(kept.samples(RATE_HZ) + 1):
        assert sent.at(sample / RATE_HZ) == kept.at(sample / RATE_HZ)
    assert kept.at(0.0)[:2] == START


def test_a_request_without_via_points_goes_by_the_polynomials_of_its_waypoints_bit_for_bit() -> None:
    planned = plan_order(Conditions("dextar", RATE_HZ, 2.0, 50.0), PlanningRequest(START, (1, -1), GOAL, 0, 0.0))
    assert not planned.course.rounded and planned.course.time_law == QUINTIC
    assert planned.path().segments == Path.through(planned.course.waypoints, planned.durations).segments
