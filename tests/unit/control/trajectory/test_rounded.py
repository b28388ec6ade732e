# SPDX-License-Identifier: Apache-2.0
"""Rounded corners: close to the via points, smooth to the third derivative, without a rest; across the locus too."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.planning.feasibility import screen_run
from fivebar_control.planning.figures import TORQUE
from fivebar_control.planning.limits import motion_limits_of
from fivebar_control.planning.predicted_run import predict_run
from fivebar_control.trajectory.criterion import criterion_residual
from fivebar_control.trajectory.path import Segment
from fivebar_control.trajectory.planner import Plan, PlanRefused, plan_motion
from fivebar_control.trajectory.rounded import SHARPEST, RoundedPolyline, RoundedSegment
from fivebar_control.trajectory.time_laws import CRITERION, OPTIMAL, QUINTIC, SEPTIC
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar

RATE_HZ = 500
VIAS = ((0.0, 0.15), (-0.03, 0.02), (0.03, 0.02), (0.0, 0.15))
"""Through the locus and back, on straight parts."""

ON_LOCUS = ((0.0, 0.15), (0.02, 0.075), (0.03, 0.02))
"""The first corner holds the crossing."""

COORDINATE = st.floats(-0.2, 0.2)
PLACE = st.tuples(COORDINATE, COORDINATE)


@st.composite
def curves(draw: st.DrawFn) -> RoundedPolyline:
    points = draw(st.lists(PLACE, min_size=3, max_size=5))
    legs = [math.dist(a, b) for a, b in pairwise(points)]
    assume(min(legs) > 0.01)
    share = draw(st.floats(0.1, 1.0))
    radii = [0.5 * share * min(pair) for pair in pairwise(legs)]
    curve = RoundedPolyline.through(points, radii)
    assume(max(curve.turn(corner) for corner in range(1, len(points) - 1)) < SHARPEST)
    return curve


@given(curves())
def test_it_goes_from_end_to_end_and_leaves_the_polyline_within_the_radius_only(curve: RoundedPolyline) -> None:
    assert curve.at(0.0)[:2] == curve.points[0]
    assert curve.at(1.0)[:2] == pytest.approx(curve.points[-1], abs=1e-15)
    inside = zip(curve.corners(), curve.points[1:-1], curve.radii[1:-1], strict=True)
    for (start, end), via, radius in inside:
        for s in np.linspace(start, end, 21).tolist():
            assert math.dist(curve.at(s)[:2], via) <= radius * (1.0 + 1e-9)
    # where the way ends that all corners leave, it is that of the polyline
    for way, (first, last) in zip(curve.ways[1:], pairwise(curve.points), strict=False):
        leg = curve.ways.index(way) - 1
        s = 0.5 * (curve.ways[leg] + curve.radii[leg] + way - curve.radii[leg + 1]) / curve.length
        share = (s * curve.length - curve.ways[leg]) / math.dist(first, last)
        on_leg = [a + share * (b - a) for a, b in zip(first, last, strict=True)]
        assert curve.at(s)[:2] == pytest.approx(on_leg, abs=1e-12)


@given(curves(), st.floats(0.02, 0.98))
def test_its_derivatives_are_those_of_the_place_and_three_are_continuous(curve: RoundedPolyline, s: float) -> None:
    step = 1e-6
    before, here, after = (np.array(curve.at(one)) for one in (s - step, s, s + step))
    # by the way, in radii: numbers about 1
    radius, length = min(curve.radii[1:-1]), curve.length
    assert (after[:2] - before[:2]) / (2.0 * step * length) == pytest.approx(here[2:4] / length, abs=1e-6)
    scale = radius / length**2
    assert (after[2:4] - before[2:4]) / (2.0 * step) * scale == pytest.approx(here[4:] * scale, abs=1e-3)
    # the third derivative, too, has no jump: the second goes on smoothly where a corner begins, ends and is half over
    for start, end in curve.corners():
        for at in (start, 0.5 * (start + end), end):
            h = 1e-5 * (end - start)
            places = np.array([curve.at(at + k * h)[4:] for k in (-2, -1, 0, 1, 2)])
            left, right = (places[1] - places[0]) / h, (places[4] - places[3]) / h
            bound = 1e-2 * np.max(np.abs(places)) / (end - start) + 1e-2 * length / (end - start) ** 2
            assert np.max(np.abs(right - left)) <= bound
        # it does not rest there
        assert math.hypot(*curve.at(0.5 * (start + end))[2:4]) > 0.25 * length


def rounded_plan(
    robot: FiveBar, points: tuple[tuple[float, float], ...], duration: float, law: str, radius: float
) -> Plan:
    legs = len(points) - 1
    durations = [duration / legs] * legs
    return plan_motion(robot, (1, -1), points, durations, RATE_HZ, ZoneRule(), law, 0.0, (radius,))


@pytest.mark.parametrize("law", [QUINTIC, SEPTIC, OPTIMAL])
def test_a_motion_round_its_corners_never_rests_on_the_way(law: str, dextar: FiveBar) -> None:
    plan = rounded_plan(dextar, VIAS, 2.4, law, 0.02)
    assert plan.path.duration == pytest.approx(2.4)
    assert len(plan.path.segments) == 1
    motion = [plan.path.at(t) for t in np.linspace(0.05, 2.35, 200).tolist()]
    assert min(math.hypot(one.vx, one.vy) for one in motion) > 0.0
    for end, place in ((0.0, VIAS[0]), (2.4, VIAS[-1])):
        assert plan.path.at(end) == pytest.approx((*place, 0.0, 0.0, 0.0, 0.0), abs=1e-9)


@pytest.mark.parametrize(("points", "law"), [(VIAS, OPTIMAL), (ON_LOCUS, OPTIMAL), (ON_LOCUS, CRITERION)])
def test_every_crossing_meets_the_criterion_and_the_run_stays_near(
    points: tuple[tuple[float, float], ...], law: str, dextar: FiveBar
) -> None:
    plan = rounded_plan(dextar, points, 0.8 * (len(points) - 1), law, 0.02)
    assert len(plan.crossings) == len(points) - 2
    for crossing in plan.crossings:
        assert abs(criterion_residual(dextar, (1, -1), plan.path.at(crossing.time))) < 1e-9
    follower = default_tuning(CONTROLLERS["unified"])
    assert screen_run(dextar, plan, RATE_HZ, follower, motion_limits_of(follower, 0.68, 20.0)).feasible
    run = predict_run(dextar, plan, RATE_HZ, follower, 0.68)
    assert run.mode_changes.value == len(plan.crossings)
    assert run.error.value < 1e-4


def test_the_screen_sees_a_torque_that_only_a_corner_asks_for(dextar: FiveBar) -> None:
    points = ((-0.04, 0.14), (0.02, 0.14), (0.02, 0.12))
    plan = rounded_plan(dextar, points, 0.5, QUINTIC, 0.001)
    follower = default_tuning(CONTROLLERS["unified"])
    verdict = screen_run(dextar, plan, RATE_HZ, follower, motion_limits_of(follower, 0.68, 20.0))
    (torque,) = (figure for figure in verdict.figures if figure.name == TORQUE)
    assert not torque.kept
    assert math.dist((torque.x, torque.y), points[1]) < 2e-3


def test_only_corners_with_a_radius_are_rounded(dextar: FiveBar) -> None:
    durations = [0.5, 0.6, 0.7]
    plan = plan_motion(dextar, (1, -1), VIAS, durations, RATE_HZ, ZoneRule(), QUINTIC, 0.0, (0.0, 0.02))
    straight, curved = plan.path.segments
    assert isinstance(straight, Segment)
    assert isinstance(curved, RoundedSegment)
    assert (straight.duration, curved.start_time, curved.duration) == pytest.approx((0.5, 0.5, 1.3))
    assert plan.path.at(0.5)[:2] == pytest.approx(VIAS[1], abs=1e-15)
    assert [crossing.segment for crossing in plan.crossings] == [0, 1]


@pytest.mark.parametrize(
    ("points", "radius", "authority", "reason"),
    [
        (VIAS, (0.02, 0.02, 0.02), 0.0, "blend_radius: 3 given for 2 waypoints"),
        (VIAS, (0.0005,), 0.0, "blend_radius: .0.0005.: expected 0 for a rest, or at least 0.001 m"),
        (VIAS, (0.04,), 0.0, "waypoints 2 and 3: blend radii of 0.04 and 0.04 m do not fit on the 0.06 m between them"),
        ((*VIAS[:2], VIAS[0]), (0.02,), 0.0, r"waypoint 2: the corner at \(-0.0300, 0.0200\) m turns by 180 degrees"),
        (((0.0, 0.15), (0.0, 0.187), (0.04, 0.14)), (0.02,), 0.0, "segment 1: .* out of reach of leg 1"),
        (ON_LOCUS, (0.02,), 0.3, "segment 1: the corner at .* is inside the blending zone of the Type 2 locus"),
    ],
)
def test_what_cannot_be_rounded_is_refused(
    points: tuple[tuple[float, float], ...], radius: tuple[float, ...], authority: float, reason: str, dextar: FiveBar
) -> None:
    durations = [1.0] * (len(points) - 1)
    with pytest.raises(PlanRefused, match=reason):
        plan_motion(dextar, (1, -1), points, durations, RATE_HZ, ZoneRule(), QUINTIC, authority, radius)


def test_without_a_radius_it_is_the_path_with_rests(dextar: FiveBar) -> None:
    plain, given_radii = (
        plan_motion(dextar, (1, -1), VIAS, [0.8] * 3, RATE_HZ, ZoneRule(), QUINTIC, 0.0, *radii)
        for radii in ((), ((0.0, 0.0),))
    )
    assert given_radii.path.segments == plain.path.segments
    assert all(isinstance(segment, Segment) for segment in plain.path.segments)
