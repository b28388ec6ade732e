# SPDX-License-Identifier: Apache-2.0
"""The closed-form singular values against numpy, the distances against a search, and the classes."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.optimize import brentq, minimize_scalar

from fivebar_control.model.geometry import elbow_position
from fivebar_control.model.kinematics import det_a, state_from_joints, state_from_platform
from fivebar_control.model.singularity import (
    FOLDED,
    STRETCHED,
    distal_links,
    inverse_condition,
    inverse_condition_rate,
    parallel_svd,
    type1_distance,
    type1_margin,
    type2_distance,
)
from fivebar_control.model.state import State
from fivebar_control.workspace.loci import type2_curves
from fivebar_description.parameters import FiveBar, LegParameters

Vector = NDArray[np.float64]
States = Callable[[int, int], list[State]]
Matrices = Callable[[State], tuple[Vector, Vector]]


def modes(state: State) -> tuple[int, int]:
    return (-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1)


def moved(robot: FiveBar, state: State, dx: float, dy: float) -> State:
    return state_from_platform(robot, modes(state), state.x + dx, state.y + dy, 0.0, 0.0)


def test_closed_form_equals_the_numerical_decomposition(regular_states: States, matrices: Matrices) -> None:
    for state in regular_states(200, 20):
        svd = parallel_svd(state)
        a, _ = matrices(state)
        u, s, v = np.linalg.svd(a)
        assert (svd.s1, svd.s2) == pytest.approx(tuple(s), abs=1e-15)
        assert svd.kappa == pytest.approx(1.0 / np.linalg.cond(a), abs=1e-15)
        assert inverse_condition(state) == pytest.approx(svd.kappa, rel=1e-14)
        if s[0] - s[1] > 0.01:  # vectors of equal singular values are arbitrary
            assert abs(v[0] @ (svd.v_x, svd.v_y)) == pytest.approx(1.0, abs=1e-12)
            assert abs(v[1] @ (svd.t_x, svd.t_y)) == pytest.approx(1.0, abs=1e-12)
            assert abs(u[:, 0] @ (math.sqrt(0.5), svd.fold * math.sqrt(0.5))) == pytest.approx(1.0, abs=1e-12)


@pytest.mark.parametrize("distals", [(0.09, 0.09), (0.08, 0.1), (0.1, 0.08)])
def test_the_branches_are_those_with_the_elbows_farthest_apart_and_nearest(
    dextar: FiveBar, distals: tuple[float, float]
) -> None:
    """Along t_s kappa grows by |1 / l_12 - e / l_22| / 2: t_s is tangent to the locus for equal folded links only."""
    l_12, l_22 = distals
    robot = dextar._replace(leg1=dextar.leg1._replace(distal=l_12), leg2=dextar.leg2._replace(distal=l_22))
    for shape, apart, slope in (
        (STRETCHED, l_12 + l_22, 0.5 * (1.0 / l_12 + 1.0 / l_22)),
        (FOLDED, abs(l_12 - l_22), 0.5 * abs(1.0 / l_12 - 1.0 / l_22)),
    ):
        curves = type2_curves(robot, shape)
        assert curves
        for joints in (closed(s) for closed in curves for s in (0.4, 1.9, 3.3, 5.2)):
            here = state_from_joints(robot, *joints, 0.0, 0.0, 0.0, 0.0)
            if type1_margin(here) < 0.2:
                continue
            svd = parallel_svd(here)
            assert distal_links(here) == shape
            (x1, y1), (x2, y2) = elbow_position(robot.leg1, joints[0]), elbow_position(robot.leg2, joints[2])
            assert math.hypot(x2 - x1, y2 - y1) == pytest.approx(apart, abs=1e-12)
            # with the motors held the elbows stay, and the platform keeps its distance from both to first order
            step = 1e-5
            beside = (moved(robot, here, sign * step * svd.t_x, sign * step * svd.t_y) for sign in (1.0, -1.0))
            found = [det_a(one) for one in beside]
            assert abs(found[0] - found[1]) / (4.0 * step) == pytest.approx(slope, abs=2e-3)


def test_elbows_of_equal_links_pass_each_other_by_the_motors_alone(dextar: FiveBar) -> None:
    """On the folded branch the platform swings about both elbows with the motors at rest; only v1 leads across."""
    (upper, *_) = type2_curves(dextar, FOLDED)
    for s in (0.7, 1.1, 2.2):
        joints = upper(s)
        here = state_from_joints(dextar, *joints, 0.0, 0.0, 0.0, 0.0)
        if type1_margin(here) < 0.2:
            continue
        elbow = elbow_position(dextar.leg1, joints[0])
        turned = state_from_platform(
            dextar, modes(here), elbow[0] + 0.09 * math.cos(s + 0.3), elbow[1] + 0.09 * math.sin(s + 0.3), 0.0, 0.0
        )
        assert (turned.leg1.q1, turned.leg2.q1) == pytest.approx((joints[0], joints[2]), abs=1e-7)
        svd = parallel_svd(here)
        speed, step = 0.3, 1e-6
        for across, along in ((1.0, 0.0), (0.6, 0.8), (0.0, 1.0)):
            velocity = speed * across * np.array([svd.v_x, svd.v_y]) + speed * along * np.array([svd.t_x, svd.t_y])
            ends = [
                np.subtract(elbow_position(dextar.leg2, one.leg2.q1), elbow_position(dextar.leg1, one.leg1.q1))
                for one in (moved(dextar, here, *(sign * step * velocity)) for sign in (1.0, -1.0))
            ]
            passing = float(np.hypot(*(ends[0] - ends[1]))) / (2.0 * step)
            cotangents = here.leg1.cos_q2 / here.leg1.sin_q2 - here.leg2.cos_q2 / here.leg2.sin_q2
            assert passing == pytest.approx(speed * across * abs(cotangents), abs=1e-4)
            with_speed = state_from_platform(dextar, modes(here), here.x, here.y, *velocity.tolist())
            assert inverse_condition_rate(with_speed) == pytest.approx(passing / 0.18, abs=1e-3)


def test_left_and_right_vectors_belong_together(regular_states: States, matrices: Matrices) -> None:
    """A v1 = s1 U_1 with U_1 = (1, e) / sqrt(2): the signs of 3.27 and 3.35 hang on this."""
    for state in regular_states(100, 21):
        svd = parallel_svd(state)
        a, _ = matrices(state)
        wanted = svd.s1 * math.sqrt(0.5) * np.array([1.0, svd.fold])
        np.testing.assert_allclose(a @ (svd.v_x, svd.v_y), wanted, atol=1e-14)
        assert svd.v_x * svd.t_x + svd.v_y * svd.t_y == 0.0
        assert math.hypot(svd.v_x, svd.v_y) == pytest.approx(1.0, abs=1e-15)


def test_on_the_locus_t_s_is_the_kernel_and_a_s_carries_the_fold(locus_states: States, matrices: Matrices) -> None:
    folds = set()
    for state in locus_states(100, 22):
        svd = parallel_svd(state)
        a, _ = matrices(state)
        np.testing.assert_allclose(a @ (svd.t_x, svd.t_y), (0.0, 0.0), atol=1e-13)
        assert svd.s1 == pytest.approx(math.sqrt(2.0), abs=1e-15)
        assert svd.kappa < 1e-13
        # thesis 3.27: A = A_s v1^T there, [1, 1] folded and [1, -1] stretched
        np.testing.assert_allclose(a @ (svd.v_x, svd.v_y), (1.0, svd.fold), atol=1e-13)
        folds.add(svd.fold)
    assert folds == {-1.0, 1.0}


def test_orthogonal_distal_links_are_the_best_conditioned(dextar: FiveBar) -> None:
    state = state_from_joints(dextar, 1.0, -1.0, 1.0, math.pi / 2.0 - 1.0, 0.0, 0.0, 0.0, 0.0)
    svd = parallel_svd(state)
    assert (svd.s1, svd.s2, svd.kappa) == pytest.approx((1.0, 1.0, 1.0), abs=1e-15)


def test_rate_of_kappa_is_its_derivative_in_time(robot: FiveBar, regular_states: States) -> None:
    h = 1e-5
    for state in regular_states(100, 23):
        ahead, behind = (inverse_condition(moved(robot, state, t * state.vx, t * state.vy)) for t in (h, -h))
        if abs(state.leg1.u_x * state.leg2.u_x + state.leg1.u_y * state.leg2.u_y) > 0.05:  # |g| has a corner at 0
            assert inverse_condition_rate(state) == pytest.approx(abs(ahead - behind) / (2.0 * h), rel=1e-5, abs=1e-5)


def test_rate_of_kappa_on_the_locus_is_that_of_the_signed_value(robot: FiveBar, locus_states: States) -> None:
    """Kappa itself has a corner there; both its one-sided derivatives have this magnitude."""
    h = 1e-7
    for state in locus_states(100, 24):
        ahead, behind = (inverse_condition(moved(robot, state, t * state.vx, t * state.vy)) for t in (h, -h))
        assert inverse_condition_rate(state) == pytest.approx(ahead / h, rel=1e-3, abs=1e-4)
        assert inverse_condition_rate(state) == pytest.approx(behind / h, rel=1e-3, abs=1e-4)


def nearest_locus_distance(robot: FiveBar, state: State, reach: float) -> float:
    """Search all directions for the nearest change of sign of det A."""

    def along(angle: float) -> float:
        def determinant(radius: float) -> float:
            return det_a(moved(robot, state, radius * math.cos(angle), radius * math.sin(angle)))

        if determinant(0.0) * determinant(reach) > 0.0:
            return reach
        return float(brentq(determinant, 0.0, reach, xtol=1e-16))

    grid = np.linspace(0.0, 2.0 * math.pi, 72, endpoint=False).tolist()
    best = min(grid, key=along)
    return float(minimize_scalar(along, bounds=(best - 0.1, best + 0.1), method="bounded").fun)


def test_type_2_distance_is_the_distance_to_first_order(robot: FiveBar, locus_states: States) -> None:
    random = np.random.default_rng(25)
    for state in locus_states(24, 25):
        angle = random.uniform(0.0, 2.0 * math.pi)
        off = moved(robot, state, 2e-5 * math.cos(angle), 2e-5 * math.sin(angle))
        true = nearest_locus_distance(robot, off, 4e-5)
        assert 0.0 < true <= 2e-5 * (1.0 + 1e-9)
        assert type2_distance(robot, off) == pytest.approx(true, rel=5e-3)


def test_type_2_distance_where_it_is_known(dextar: FiveBar) -> None:
    """On the axis of symmetry the locus is met straight ahead."""
    y = math.sqrt(0.0081 - 0.000961)
    for offset in (1e-5, -1e-5, 1e-4):
        state = state_from_platform(dextar, (1, -1), 0.0, y + offset, 0.0, 0.0)
        assert type2_distance(dextar, state) == pytest.approx(abs(offset), rel=20.0 * abs(offset))
    assert type2_distance(dextar, state_from_platform(dextar, (1, -1), 0.0, y, 0.0, 0.0)) < 1e-15


def test_type_2_distance_where_both_distal_links_turn_alike_is_unknown(dextar: FiveBar) -> None:
    """Parallel legs: to first order no way leads off the locus or towards it."""
    parallel = state_from_joints(dextar, 1.0, 0.7, 1.0, 0.7, 0.0, 0.0, 0.0, 0.0)
    assert type2_distance(dextar, parallel) == math.inf
    nearly = state_from_joints(dextar, 1.0, 0.7, 1.01, 0.7, 0.0, 0.0, 0.0, 0.0)
    assert 0.0 < type2_distance(dextar, nearly) < math.inf


def test_type_2_distance_of_distal_links_at_right_angles_is_a_number(dextar: FiveBar) -> None:
    """Rounding puts det A beyond 1 for some of them."""
    beyond = 0
    for theta in np.linspace(0.1, 3.0, 200).tolist():
        square = state_from_joints(dextar, 1.0, theta - 1.0, 2.0, theta + 0.5 * math.pi - 2.0, 0.0, 0.0, 0.0, 0.0)
        beyond += abs(det_a(square)) > 1.0
        assert type2_distance(dextar, square) > 0.0
    assert beyond > 0


def test_type_1_distance_and_margin(dextar: FiveBar) -> None:
    state = state_from_platform(dextar, (1, -1), 0.03, 0.12, 0.0, 0.0)
    assert type1_distance(dextar, state) == pytest.approx(0.18 - math.hypot(0.089, 0.12), abs=1e-16)
    near_base = state_from_platform(dextar, (1, -1), -0.05, 0.02, 0.0, 0.0)
    assert type1_distance(dextar, near_base) == pytest.approx(math.hypot(0.009, 0.02), abs=1e-16)
    assert type1_margin(state) == pytest.approx(min(abs(math.sin(state.leg1.q2)), abs(math.sin(state.leg2.q2))))


@pytest.mark.parametrize("x", [-0.14, 0.14])
def test_no_margin_where_one_leg_does_not_reach(dextar: FiveBar, x: float) -> None:
    state = state_from_platform(dextar, (1, -1), x, 0.05, 0.0, 0.0)
    assert math.isnan(state.leg1.sin_q2) != math.isnan(state.leg2.sin_q2)
    assert math.isnan(type1_margin(state))


def type_3_robot(dextar: FiveBar) -> FiveBar:
    """A five-bar whose legs can both be stretched along x at once: 0.1 + 0.1 = 0.1 + (0.06 + 0.04)."""

    def leg(base_x: float, proximal: float, distal: float) -> LegParameters:
        return dextar.leg1._replace(base_x=base_x, proximal=proximal, distal=distal)

    return FiveBar(leg(-0.05, 0.1, 0.1), leg(0.05, 0.06, 0.04), 0.5)


def test_every_class_is_told(dextar: FiveBar) -> None:
    """Type 1 by |sin q_i2|, Type 2 by kappa, either by itself or both."""
    regular = state_from_platform(dextar, (1, -1), 0.0, 0.13, 0.0, 0.0)
    stretched = dextar.leg1.base_x + 0.18 * math.cos(1.1), 0.18 * math.sin(1.1)
    serial = state_from_platform(dextar, (1, -1), *stretched, 0.0, 0.0)
    parallel = state_from_platform(dextar, (1, -1), 0.0, math.sqrt(0.0081 - 0.000961), 0.0, 0.0)
    both = state_from_joints(type_3_robot(dextar), 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert (both.x, both.y) == pytest.approx((0.15, 0.0), abs=1e-16)
    margins = [(type1_margin(one), inverse_condition(one)) for one in (regular, serial, parallel, both)]
    assert [(one <= 1e-6, two <= 1e-6) for one, two in margins] == [
        (False, False),
        (True, False),
        (False, True),
        (True, True),
    ]


def test_distances_from_both_loci(dextar: FiveBar) -> None:
    near = state_from_platform(dextar, (1, -1), 0.0, math.sqrt(0.0081 - 0.000961) + 1e-4, 0.0, 0.0)
    assert type2_distance(dextar, near) == pytest.approx(1e-4, rel=2e-3)
    assert type1_distance(dextar, near) == pytest.approx(0.18 - math.hypot(0.059, near.y), abs=1e-16)
