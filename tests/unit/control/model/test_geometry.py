# SPDX-License-Identifier: Apache-2.0
"""Inverse and direct geometry against each other, against circles, and against the thesis' posture."""

from __future__ import annotations

import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from fivebar_control.model.geometry import (
    direct_geometry,
    inverse_geometry,
    leg_angles,
    leg_cosine,
    reach_margin,
    workspace_bounds,
    wrap,
)
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import WorkingMode
from fivebar_description.parameters import FiveBar, LegParameters

SIGN = st.sampled_from([-1, 1])
COORDINATE = st.floats(-0.22, 0.22)
ANGLE = st.floats(-math.pi, math.pi)


def elbow_side(leg: LegParameters, q1: float, x: float, y: float) -> float:
    """Positive where the elbow lies counter-clockwise of the line from the base to the platform."""
    elbow_x, elbow_y = leg.proximal * math.cos(q1), leg.proximal * math.sin(q1)
    return (x - leg.base_x) * elbow_y - y * elbow_x


def distance(x1: float, y1: float, x2: float, y2: float) -> float:
    return math.hypot(x1 - x2, y1 - y2)


def reachable(robot: FiveBar, x: float, y: float, by: float) -> bool:
    return min(reach_margin(robot.leg1, x, y), reach_margin(robot.leg2, x, y)) > by


@given(mode=st.tuples(SIGN, SIGN), x=COORDINATE, y=COORDINATE)
def test_inverse_geometry_closes_both_legs_with_elbows_on_the_wanted_sides(
    robot: FiveBar, mode: WorkingMode, x: float, y: float
) -> None:
    assume(reachable(robot, x, y, by=1e-4))
    q = inverse_geometry(robot, mode, x, y)
    for leg, sign, q1, q2 in ((robot.leg1, mode[0], q.q11, q.q12), (robot.leg2, mode[1], q.q21, q.q22)):
        tip_x = leg.base_x + leg.proximal * math.cos(q1) + leg.distal * math.cos(q1 + q2)
        tip_y = leg.proximal * math.sin(q1) + leg.distal * math.sin(q1 + q2)
        # the angle of the distal link comes from its cosine, which magnifies rounding where the leg is nearly straight
        assert distance(tip_x, tip_y, x, y) < 2e-16 / abs(math.sin(q2))
        assert elbow_side(leg, q1, x, y) * sign > 0.0
        assert -math.pi < q1 <= math.pi


@given(mode=st.tuples(SIGN, SIGN), x=COORDINATE, y=COORDINATE)
def test_direct_geometry_undoes_inverse_geometry(robot: FiveBar, mode: WorkingMode, x: float, y: float) -> None:
    assume(reachable(robot, x, y, by=1e-4))
    determinant = det_a(state_from_platform(robot, mode, x, y, 0.0, 0.0))
    assume(abs(determinant) > 1e-3)
    q = inverse_geometry(robot, mode, x, y)
    # the circles meet at the angle whose sine is det A, which magnifies rounding
    found = direct_geometry(robot, 1 if determinant > 0.0 else -1, q.q11, q.q21)
    assert distance(*found, x, y) < 1e-15 / abs(determinant)


@given(q11=ANGLE, q21=ANGLE)
@pytest.mark.parametrize("assembly", [1, -1])
def test_inverse_geometry_undoes_direct_geometry(robot: FiveBar, assembly: int, q11: float, q21: float) -> None:
    x, y = direct_geometry(robot, assembly, q11, q21)
    assume(not math.isnan(x))
    assume(reachable(robot, x, y, by=1e-4))
    one, two = (1 if elbow_side(leg, q1, x, y) > 0.0 else -1 for leg, q1 in ((robot.leg1, q11), (robot.leg2, q21)))
    determinant = det_a(state_from_platform(robot, (one, two), x, y, 0.0, 0.0))
    assume(abs(determinant) > 1e-3)
    assert determinant * assembly > 0.0
    q = inverse_geometry(robot, (one, two), x, y)
    for found, wanted in ((q.q11, q11), (q.q21, q21)):
        # acos magnifies rounding towards Type 1, 1e-4 m away at worst
        assert abs(wrap(found - wanted)) < 1e-11


@given(q11=ANGLE, q21=ANGLE)
def test_both_assembly_modes_are_mirror_images_over_the_line_of_the_elbows(
    robot: FiveBar, q11: float, q21: float
) -> None:
    first, second = (direct_geometry(robot, assembly, q11, q21) for assembly in (1, -1))
    assume(not math.isnan(first[0]))
    elbows = [
        (leg.base_x + leg.proximal * math.cos(q1), leg.proximal * math.sin(q1))
        for leg, q1 in ((robot.leg1, q11), (robot.leg2, q21))
    ]
    (e1_x, e1_y), (e2_x, e2_y) = elbows
    assume(distance(e1_x, e1_y, e2_x, e2_y) > 1e-3)
    for x, y in (first, second):
        assert distance(x, y, e1_x, e1_y) == pytest.approx(robot.leg1.distal, abs=1e-13)
        assert distance(x, y, e2_x, e2_y) == pytest.approx(robot.leg2.distal, abs=1e-13)
    side1, side2 = ((x - e1_x) * (y - e2_y) - (y - e1_y) * (x - e2_x) for x, y in (first, second))
    assert side1 >= 0.0 >= side2
    assert side1 == pytest.approx(-side2, abs=1e-15)


def test_posture_of_section_3_3(dextar: FiveBar) -> None:
    """The angles of 3.45. Its second column drops a sign: the distal links are stretched there, u2 = -u1."""
    q = inverse_geometry(dextar, (1, -1), -0.06745, 0.03989)
    printed = (3.1218, -2.6846, 2.0933, -4.7977)
    for angle, wanted in zip(q, printed, strict=True):
        assert abs(wrap(angle - wanted)) < 5e-4
    state = state_from_platform(dextar, (1, -1), -0.06745, 0.03989, 0.0, 0.0)
    assert abs(det_a(state)) < 5e-4
    assert (state.leg1.u_x, state.leg1.u_y) == pytest.approx((0.9059, 0.4235), abs=2e-4)
    assert (state.leg2.u_x, state.leg2.u_y) == pytest.approx((-0.9060, -0.4235), abs=2e-4)


def test_the_vertical_path_meets_the_locus_where_the_distal_links_are_level(dextar: FiveBar) -> None:
    """Elbows outwards at (-+0.09, h): level distal links put the platform at h = sqrt(0.09^2 - 0.031^2)."""
    y = math.sqrt(0.0081 - 0.000961)
    assert y == pytest.approx(0.08449, abs=5e-6)
    state = state_from_platform(dextar, (1, -1), 0.0, y, 0.0, 0.0)
    assert abs(det_a(state)) < 1e-15
    assert (state.leg1.u_x, state.leg2.u_x) == pytest.approx((1.0, -1.0), abs=1e-15)
    above, below = (det_a(state_from_platform(dextar, (1, -1), 0.0, y + offset, 0.0, 0.0)) for offset in (1e-6, -1e-6))
    assert above * below < 0.0


@pytest.mark.parametrize(("x", "y"), [(0.0, 0.18), (0.15, 0.0), (0.3, 0.3)])
def test_a_leg_that_cannot_reach_has_no_angles(dextar: FiveBar, x: float, y: float) -> None:
    q = inverse_geometry(dextar, (1, -1), x, y)
    out_of_reach = [math.hypot(x - leg.base_x, y) > 0.18 for leg in (dextar.leg1, dextar.leg2)]
    assert [math.isnan(q.q11), math.isnan(q.q21)] == out_of_reach
    assert [math.isnan(q.q12), math.isnan(q.q22)] == out_of_reach
    assert True in out_of_reach


def test_unequal_links_leave_a_hole_around_the_motor_axis(robot: FiveBar) -> None:
    leg = robot.leg1
    hole = abs(leg.proximal - leg.distal)
    inside = leg_angles(leg, 1, leg.base_x, 0.5 * hole)
    outside = leg_angles(leg, 1, leg.base_x, hole + 1e-3)
    assert math.isnan(inside[0]) == (hole > 0.0)
    assert math.isfinite(outside[0])


@pytest.mark.parametrize(("q11", "q21"), [(math.pi, 0.0), (3.0, 0.2)])
def test_distal_links_that_cannot_meet_have_no_platform(dextar: FiveBar, q11: float, q21: float) -> None:
    """Elbows 0.298 m apart, links of 0.09 m each."""
    for assembly in (1, -1):
        x, y = direct_geometry(dextar, assembly, q11, q21)
        assert math.isnan(x)
        assert math.isnan(y)


def test_elbows_in_one_point_leave_the_platform_open(dextar: FiveBar) -> None:
    centred = dextar._replace(leg1=dextar.leg1._replace(base_x=0.059))
    assert math.isnan(direct_geometry(centred, 1, 1.0, 1.0)[0])


def test_leg_cosine_is_the_law_of_cosines(robot: FiveBar) -> None:
    leg = robot.leg2
    reach = leg.proximal + leg.distal
    assert leg_cosine(leg, leg.base_x, reach) == pytest.approx(1.0, abs=1e-15)
    assert leg_cosine(leg, leg.base_x - math.hypot(leg.proximal, leg.distal), 0.0) == pytest.approx(0.0, abs=1e-15)
    assert leg_cosine(leg, leg.base_x, 1.1 * reach) > 1.0


def test_reach_margin_is_a_length(robot: FiveBar) -> None:
    for leg in (robot.leg1, robot.leg2):
        outer, inner = leg.proximal + leg.distal, abs(leg.proximal - leg.distal)
        along = (math.cos(0.7), math.sin(0.7))
        for radius, margin in (
            (outer - 0.002, 0.002),
            (outer + 0.003, -0.003),
            (inner + 0.004, 0.004),
            (inner - 0.001, -0.001),
        ):
            if radius >= 0.0:
                found = reach_margin(leg, leg.base_x + radius * along[0], radius * along[1])
                assert found == pytest.approx(margin, abs=1e-16)


@pytest.mark.parametrize(
    ("angle", "wanted"),
    [
        (0.0, 0.0),
        (3.0, 3.0),
        (-3.0, -3.0),
        (math.pi, math.pi),
        (-math.pi, math.pi),
        (3.5, 3.5 - 2.0 * math.pi),
        (-3.5, 2.0 * math.pi - 3.5),
        (2.0 * math.pi, 0.0),
        (-4.7977, 2.0 * math.pi - 4.7977),
    ],
)
def test_wrap_at_chosen_angles(angle: float, wanted: float) -> None:
    assert wrap(angle) == pytest.approx(wanted, abs=1e-15)


@given(angle=st.floats(-1e4, 1e4))
def test_wrap_turns_by_whole_turns_into_half_open_range(angle: float) -> None:
    wrapped = wrap(angle)
    assert -math.pi < wrapped <= math.pi
    assert math.remainder(angle - wrapped, 2.0 * math.pi) == pytest.approx(0.0, abs=4e-12)


@pytest.mark.parametrize("mirrored", [False, True])
def test_the_bounds_are_the_common_part_of_both_legs_boxes(dextar: FiveBar, mirrored: bool) -> None:
    long = dextar.leg1._replace(base_x=-0.02, proximal=0.1, distal=0.2)
    short = dextar.leg1._replace(base_x=0.05, proximal=0.08, distal=0.09)
    legs = (short, long) if mirrored else (long, short)
    bounds = workspace_bounds(dextar._replace(leg1=legs[0], leg2=legs[1]))
    # the circle of the short leg lies inside that of the long one
    assert tuple(bounds) == pytest.approx((0.05 - 0.17, 0.05 + 0.17, -0.17, 0.17))
    apart = short._replace(base_x=0.25)
    legs = (apart, long) if mirrored else (long, apart)
    bounds = workspace_bounds(dextar._replace(leg1=legs[0], leg2=legs[1]))
    assert bounds.left == pytest.approx(0.25 - 0.17)
    assert bounds.right == pytest.approx(-0.02 + 0.3)
