# SPDX-License-Identifier: Apache-2.0
"""Velocities and accelerations against finite differences of the geometry, and against Pinocchio."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import (
    assembly_mode,
    det_a,
    distal_acceleration,
    distal_acceleration_by_motor,
    elbow_side,
    joint_acceleration,
    joints_of,
    platform_acceleration,
    state_from_joints,
    state_from_motors,
    state_from_platform,
    working_mode,
)
from fivebar_control.model.state import State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar

Vector = NDArray[np.float64]
States = Callable[[int, int], list[State]]
Vectors = Callable[[State], tuple[Vector, Vector]]

H = 1e-3
FIRST = np.array([1.0, -8.0, 0.0, 8.0, -1.0]) / (12.0 * H)
SECOND = np.array([-1.0, 16.0, -30.0, 16.0, -1.0]) / (12.0 * H * H)


def modes(state: State) -> tuple[int, int]:
    """The working mode, from the sign of sin q_i2."""
    return -int(math.copysign(1.0, math.sin(state.leg1.q2))), -int(math.copysign(1.0, math.sin(state.leg2.q2)))


def angles_along(robot: FiveBar, state: State, ax: float, ay: float) -> Vector:
    """The four joint angles at five instants around a state under a constant platform acceleration, shape (5, 4)."""
    times = np.array([-2.0, -1.0, 0.0, 1.0, 2.0]) * H
    rows = [
        inverse_geometry(
            robot,
            modes(state),
            state.x + state.vx * t + 0.5 * ax * t * t,
            state.y + state.vy * t + 0.5 * ay * t * t,
        )
        for t in times.tolist()
    ]
    return np.unwrap(np.array(rows), axis=0)


def slow(state: State, robot: FiveBar) -> State:
    """The state at a fifth of its speed, so that five instants stay close together."""
    return state_from_platform(robot, modes(state), state.x, state.y, 0.2 * state.vx, 0.2 * state.vy)


@pytest.mark.parametrize("where", ["regular", "locus"])
def test_rates_and_accelerations_are_derivatives_of_the_angles(
    where: str, robot: FiveBar, regular_states: States, locus_states: States
) -> None:
    random = np.random.default_rng(10)
    for fast in (regular_states if where == "regular" else locus_states)(100, 11):
        state = slow(fast, robot)
        ax, ay = random.uniform(-1.0, 1.0, 2).tolist()
        angles = angles_along(robot, state, ax, ay)
        thetas = np.column_stack([angles[:, 0], angles[:, 0] + angles[:, 1], angles[:, 2], angles[:, 2] + angles[:, 3]])
        rates, bends = FIRST @ thetas, SECOND @ thetas
        analytic = [state.leg1.dq1, state.leg1.dtheta, state.leg2.dq1, state.leg2.dtheta]
        np.testing.assert_allclose(analytic, rates, rtol=1e-6, atol=1e-6)
        accelerations = [joint_acceleration(leg, ax, ay) for leg in (state.leg1, state.leg2)]
        np.testing.assert_allclose(accelerations, bends[[0, 2]], rtol=1e-4, atol=1e-3)


@pytest.mark.parametrize("where", ["regular", "locus"])
def test_first_order_relation_holds_for_pinocchios_platform(
    where: str, loop: ClosedLoop, regular_states: States, locus_states: States, joint_vectors: Vectors
) -> None:
    """A xdot = B qdot with the platform velocity that Pinocchio gives for the joint rates."""
    for state in (regular_states if where == "regular" else locus_states)(100, 12):
        q, v = joint_vectors(state)
        position, velocity, _ = loop.platform(q, v, np.zeros(4))
        np.testing.assert_allclose(position, (state.x, state.y), atol=1e-15)
        np.testing.assert_allclose(velocity, (state.vx, state.vy), atol=1e-13)
        for leg in (state.leg1, state.leg2):
            assert leg.u_x * velocity[0] + leg.u_y * velocity[1] == pytest.approx(leg.b * leg.dq1, abs=1e-14)


@pytest.mark.parametrize("where", ["regular", "locus"])
def test_second_order_relation_holds_for_pinocchios_platform(
    where: str, loop: ClosedLoop, regular_states: States, locus_states: States, joint_vectors: Vectors
) -> None:
    """A xddot + c = B qddot for a motion of the closed loop that Pinocchio finds."""
    random = np.random.default_rng(13)
    for state in (regular_states if where == "regular" else locus_states)(100, 13):
        q, v = joint_vectors(state)
        a = loop.acceleration(q, v, np.array([random.uniform(-2, 2), 0.0, random.uniform(-2, 2), 0.0]))
        _, _, (ax, ay) = loop.platform(q, v, a)
        scale = np.abs(a).max()
        assert joint_acceleration(state.leg1, ax, ay) == pytest.approx(a[0], abs=1e-12 * scale)
        assert joint_acceleration(state.leg2, ax, ay) == pytest.approx(a[2], abs=1e-12 * scale)


def test_platform_acceleration_agrees_with_pinocchio(
    loop: ClosedLoop, regular_states: States, joint_vectors: Vectors
) -> None:
    random = np.random.default_rng(14)
    for state in regular_states(100, 14):
        q, v = joint_vectors(state)
        a = loop.acceleration(q, v, np.array([random.uniform(-2, 2), 0.0, random.uniform(-2, 2), 0.0]))
        wanted = loop.platform(q, v, a)[2]
        found = platform_acceleration(state, float(a[0]), float(a[2]))
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=1e-10 * np.abs(a).max())


@pytest.mark.parametrize("where", ["regular", "locus"])
def test_joints_and_platform_give_the_same_state(
    where: str, robot: FiveBar, regular_states: States, locus_states: States, joint_vectors: Vectors
) -> None:
    for state in (regular_states if where == "regular" else locus_states)(100, 15):
        q, v = joint_vectors(state)
        again = state_from_joints(robot, *q.tolist(), *v.tolist())
        np.testing.assert_allclose(again[2:], state[2:], rtol=0.0, atol=1e-14)
        for one, other in ((again.leg1, state.leg1), (again.leg2, state.leg2)):
            np.testing.assert_allclose(one, other, rtol=1e-12, atol=1e-14)


def test_windings_of_a_joint_change_nothing(robot: FiveBar) -> None:
    turn = 2.0 * math.pi
    one = state_from_joints(robot, 2.0, -1.0, 1.0, 1.5, 0.1, 0.2, 0.3, 0.4)
    other = state_from_joints(robot, 2.0 - turn, -1.0 + turn, 1.0, 1.5 - turn, 0.1, 0.2, 0.3, 0.4)
    np.testing.assert_allclose(other[2:], one[2:], rtol=0.0, atol=1e-15)
    assert det_a(other) == pytest.approx(det_a(one), abs=1e-15)


def test_measured_platform_is_the_mean_of_both_legs(robot: FiveBar) -> None:
    """Encoders leave the loop open; the platform is taken half way between both tips."""
    q = (2.0, -1.0, 1.0, 1.5)
    state = state_from_joints(robot, *q, 0.0, 0.0, 0.0, 0.0)
    tips = [
        (
            leg.base_x + leg.proximal * math.cos(q1) + leg.distal * math.cos(q1 + q2),
            leg.proximal * math.sin(q1) + leg.distal * math.sin(q1 + q2),
        )
        for leg, q1, q2 in ((robot.leg1, q[0], q[1]), (robot.leg2, q[2], q[3]))
    ]
    assert math.dist(*tips) > 0.01
    np.testing.assert_allclose((state.x, state.y), np.mean(tips, axis=0), atol=1e-16)


def test_rates_are_undefined_at_type_1_and_out_of_reach(dextar: FiveBar) -> None:
    stretched = state_from_platform(dextar, (1, -1), -0.059, 0.18, 0.1, 0.1)
    assert stretched.leg1.b == 0.0
    assert math.isnan(stretched.leg1.dq1)
    assert math.isnan(stretched.leg1.dtheta)
    assert math.isnan(joint_acceleration(stretched.leg1, 1.0, 1.0))
    outside = state_from_platform(dextar, (1, -1), 0.0, 0.2, 0.1, 0.1)
    assert all(math.isnan(number) for leg in (outside.leg1, outside.leg2) for number in leg)
    assert outside[2:] == (0.0, 0.2, 0.1, 0.1)


def test_acceleration_from_the_motors_is_undefined_on_the_locus(dextar: FiveBar) -> None:
    """Both distal angles are exactly 0, so det A is exactly 0."""
    on_locus = state_from_joints(dextar, 1.0, -1.0, 2.0, -2.0, 0.3, 0.0, 0.4, 0.0)
    assert det_a(on_locus) == 0.0
    assert all(math.isnan(number) for number in platform_acceleration(on_locus, 1.0, 2.0))


@pytest.mark.parametrize("where", ["regular", "locus"])
def test_distal_accelerations_agree_with_pinocchio(
    where: str, robot: FiveBar, loop: ClosedLoop, regular_states: States, locus_states: States, joint_vectors: Vectors
) -> None:
    random = np.random.default_rng(16)
    for state in (regular_states if where == "regular" else locus_states)(100, 16):
        q, v = joint_vectors(state)
        a = loop.acceleration(q, v, np.array([random.uniform(-2, 2), 0.0, random.uniform(-2, 2), 0.0]))
        ax, ay = loop.platform(q, v, a)[2].tolist()
        scale = float(np.abs(a).max())
        assert distal_acceleration(robot.leg1, state.leg1, ax, ay) == pytest.approx(a[0] + a[1], abs=1e-12 * scale)
        assert distal_acceleration(robot.leg2, state.leg2, ax, ay) == pytest.approx(a[2] + a[3], abs=1e-12 * scale)


@pytest.mark.parametrize("where", ["regular", "locus"])
def test_distal_accelerations_follow_from_motors_and_platform_too(
    where: str, robot: FiveBar, loop: ClosedLoop, regular_states: States, locus_states: States, joint_vectors: Vectors
) -> None:
    random = np.random.default_rng(17)
    for state in (regular_states if where == "regular" else locus_states)(50, 17):
        q, v = joint_vectors(state)
        a = loop.acceleration(q, v, np.array([random.uniform(-2, 2), 0.0, random.uniform(-2, 2), 0.0]))
        ax, ay = loop.platform(q, v, a)[2].tolist()
        scale = float(np.abs(a).max())
        for leg, at, motor, bend in ((robot.leg1, state.leg1, a[0], a[1]), (robot.leg2, state.leg2, a[2], a[3])):
            found = distal_acceleration_by_motor(leg, at, float(motor), ax, ay)
            assert found == pytest.approx(motor + bend, abs=1e-12 * scale)


def test_distal_acceleration_by_motor_is_regular_at_type_1(robot: FiveBar) -> None:
    """Leg 1 stretched, turning at both joints: against the second difference of its distal angle.

    The tip of a leg with q1 = q0 + w t + a t^2 / 2 and theta likewise is differenced for the platform's acceleration.
    """
    leg, (q, w, a), (theta, dtheta, ddtheta), h = robot.leg1, (0.9, 1.3, -2.0), (0.9, -0.7, 5.0), 1e-4

    def tip(t: float) -> Vector:
        q1, inclined = q + w * t + 0.5 * a * t * t, theta + dtheta * t + 0.5 * ddtheta * t * t
        return leg.proximal * np.array([math.cos(q1), math.sin(q1)]) + leg.distal * np.array(
            [math.cos(inclined), math.sin(inclined)]
        )

    ax, ay = ((tip(h) - 2.0 * tip(0.0) + tip(-h)) / h**2).tolist()
    state = state_from_joints(robot, q, 0.0, 2.0, -1.0, w, dtheta - w, 0.3, 0.1)
    assert state.leg1.sin_q2 == 0.0
    assert distal_acceleration_by_motor(leg, state.leg1, a, ax, ay) == pytest.approx(ddtheta, abs=1e-5)


def test_distal_acceleration_is_undefined_at_type_1(dextar: FiveBar) -> None:
    straight = state_from_joints(dextar, 1.0, 0.0, 2.0, -1.0, 0.1, 0.2, 0.3, 0.1)
    assert math.isnan(distal_acceleration(dextar.leg1, straight.leg1, 1.0, 1.0))


def expect_same(found: State, wanted: State) -> None:
    for one, other in ((found.leg1, wanted.leg1), (found.leg2, wanted.leg2)):
        np.testing.assert_allclose(one, other, rtol=1e-9, atol=1e-9)
    np.testing.assert_allclose(found[2:], wanted[2:], rtol=1e-9, atol=1e-9)


def test_both_motors_and_the_assembly_mode_give_the_whole_state(robot: FiveBar, regular_states: States) -> None:
    for state in regular_states(40, 18):
        leg1, leg2 = state.leg1, state.leg2
        expect_same(state_from_motors(robot, assembly_mode(state), leg1.q1, leg2.q1, leg1.dq1, leg2.dq1), state)


def test_both_motors_give_the_state_where_a_leg_is_stretched_too(robot: FiveBar, loop: ClosedLoop) -> None:
    """Either leg, turning at both joints: the rates are those with which Pinocchio's loop stays closed."""
    for stretched, mode in ((0, -1), (1, 1)):
        leg = robot[stretched]
        reach = leg.proximal + leg.distal
        angle = 1.1 if stretched == 0 else 2.0
        place = leg.base_x + reach * math.cos(angle), reach * math.sin(angle)
        q = np.array(inverse_geometry(robot, (-mode, mode), *place))
        q[2 * stretched : 2 * stretched + 2] = angle, 0.0
        _, v, gap = loop.close(q, np.array([0.4, -0.7, 0.5, 0.3]))
        assert gap < 1e-12
        wanted = state_from_joints(robot, *q.tolist(), *v.tolist())
        assert (wanted.leg1, wanted.leg2)[stretched].b == 0.0
        found = state_from_motors(robot, assembly_mode(wanted), q[0], q[2], v[0], v[2])
        np.testing.assert_allclose(joints_of(found), [*q, *v], rtol=0.0, atol=1e-6)
        np.testing.assert_allclose(found[2:], wanted[2:], rtol=0.0, atol=1e-6)


def test_motors_whose_distal_links_cannot_meet_have_no_state_but_their_angles(dextar: FiveBar) -> None:
    """Or are in line, to the last bit, where the motors' speeds do not determine the platform's."""
    far = dextar._replace(leg2=dextar.leg2._replace(base_x=10.0))
    # elbows 0.2 m apart with distal links of 0.1 m
    one, two = dextar.leg1._replace(distal=0.1), dextar.leg2._replace(distal=0.1)
    apart = dextar._replace(leg1=one._replace(base_x=-0.1, proximal=0.05), leg2=two._replace(base_x=0.1, proximal=0.05))
    for robot, q11, q21 in ((far, 1.0, 2.0), (apart, 0.5 * math.pi, 0.5 * math.pi)):
        state = state_from_motors(robot, 1, q11, q21, 0.1, 0.2)
        assert (state.leg1.q1, state.leg2.q1) == (q11, q21)
        assert (state.leg1.r_x, state.leg2.r_y) == (math.cos(q11), math.sin(q21))
        for leg in (state.leg1, state.leg2):
            assert all(map(math.isnan, (leg.q2, leg.dq1, leg.dtheta, leg.u_x, leg.u_y, leg.b, leg.c)))
        assert all(map(math.isnan, state[2:]))


def test_joints_of_a_state_are_those_it_was_made_from(robot: FiveBar) -> None:
    joints = (2.0, -1.0, 1.0, 1.5, 0.3, -0.2, 0.7, 0.9)
    assert joints_of(state_from_joints(robot, *joints)) == pytest.approx(joints, abs=1e-15)


def test_modes_are_where_the_elbows_and_the_platform_are(robot: FiveBar, regular_states: States) -> None:
    """Elbows by the line from base to platform, the platform by the line from elbow to elbow."""
    for state in regular_states(40, 19):
        platform, elbows, sides = np.array([state.x, state.y]), [], []
        for parameters, leg in ((robot.leg1, state.leg1), (robot.leg2, state.leg2)):
            base = np.array([parameters.base_x, 0.0])
            elbow = base + parameters.proximal * np.array([math.cos(leg.q1), math.sin(leg.q1)])
            (ax, ay), (bx, by) = platform - base, elbow - base
            sides.append(int(np.sign(ax * by - ay * bx)))
            elbows.append(elbow)
        assert list(working_mode(state)) == sides
        (ax, ay), (bx, by) = platform - elbows[0], platform - elbows[1]
        assert assembly_mode(state) == int(np.sign(ax * by - ay * bx))


def test_modes_at_the_singularities_are_declared(dextar: FiveBar) -> None:
    on_locus = state_from_joints(dextar, 1.0, -1.0, 2.0, -2.0, 0.3, 0.0, 0.4, 0.0)
    assert assembly_mode(on_locus) == -1
    assert assembly_mode(state_from_platform(dextar, (1, -1), 9.0, 9.0, 0.0, 0.0)) == -1
    assert elbow_side(0.0) == 1
    assert (elbow_side(1e-9), elbow_side(-1e-9)) == (-1, 1)
