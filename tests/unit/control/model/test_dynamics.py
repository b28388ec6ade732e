# SPDX-License-Identifier: Apache-2.0
"""The reduced model of 1.30 and 1.31 against Pinocchio's closed loop, energy and the dynamic criterion."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.model.constraint_form import DynamicResponse, Pushed, constraint_form, response_to
from fivebar_control.model.dynamics import (
    direct_dynamics,
    direct_dynamics_of_platform,
    inverse_dynamics,
    inverse_dynamics_of_platform,
    multipliers,
    platform_model,
)
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import state_from_joints, state_from_platform, working_mode
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import State, WorkingMode
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar

Vector = NDArray[np.float64]
States = Callable[[int, int], list[State]]
Vectors = Callable[[State], tuple[Vector, Vector]]
Matrices = Callable[[State], tuple[Vector, Vector]]

TOLERANCE = 1e-12
"""Of the largest term: of the accelerations that add up to the one asked for, those of the rates squared included."""

ON_THE_LOCUS = pytest.mark.parametrize("where", ["regular", "locus"])


def check_against_pinocchio(robot: FiveBar, loop: ClosedLoop, state: State, q: Vector, v: Vector, tau: Vector) -> None:
    a = loop.acceleration(q, v, np.array([tau[0], 0.0, tau[1], 0.0]))
    motion = direct_dynamics(robot, state, *tau.tolist(), 0.0, 0.0)
    np.testing.assert_allclose((motion.ddq11, motion.ddq21), a[[0, 2]], rtol=0.0, atol=TOLERANCE * np.abs(a).max())
    platform = loop.platform(q, v, a)[2]
    np.testing.assert_allclose((motion.ax, motion.ay), platform, rtol=0.0, atol=TOLERANCE * largest(state, platform))


def largest(state: State, platform: Vector) -> float:
    """Return the largest term of a platform's acceleration (m/s^2)."""
    return float(max(np.abs(platform).max(), abs(state.leg1.c), abs(state.leg2.c)))


@ON_THE_LOCUS
def test_direct_dynamics_is_pinocchios_closed_loop(
    where: str, robot: FiveBar, loop: ClosedLoop, regular_states: States, locus_states: States, joint_vectors: Vectors
) -> None:
    """The half masses at the tips and the contact between them give exactly the reduced model."""
    random = np.random.default_rng(30)
    for state in (regular_states if where == "regular" else locus_states)(400, 31):
        check_against_pinocchio(robot, loop, state, *joint_vectors(state), random.uniform(-3.0, 3.0, 2))


def test_direct_dynamics_is_regular_at_type_1(robot: FiveBar, loop: ClosedLoop) -> None:
    """Leg 1 is stretched to the last bit: sin q12 = 0."""
    random = np.random.default_rng(32)
    reach = robot.leg1.proximal + robot.leg1.distal
    found = 0
    while found < 50:
        q11 = random.uniform(0.0, math.pi)
        place = robot.leg1.base_x + reach * math.cos(q11), reach * math.sin(q11)
        target = inverse_geometry(robot, (1, -1), *place)
        if math.isnan(target.q21) or abs(math.sin(target.q22)) < 0.1:
            continue
        q = np.array([q11, 0.0, target.q21, target.q22])
        _, v, gap = loop.close(q, random.uniform(-3.0, 3.0, 4))
        assert gap < 1e-15
        state = state_from_joints(robot, *q.tolist(), *v.tolist())
        assert state.leg1.b == 0.0
        check_against_pinocchio(robot, loop, state, q, v, random.uniform(-3.0, 3.0, 2))
        found += 1


@ON_THE_LOCUS
def test_platform_form_is_pinocchios_closed_loop(
    where: str, robot: FiveBar, loop: ClosedLoop, regular_states: States, locus_states: States, joint_vectors: Vectors
) -> None:
    random = np.random.default_rng(33)
    for state in (regular_states if where == "regular" else locus_states)(400, 34):
        q, v = joint_vectors(state)
        tau1, tau2 = random.uniform(-3.0, 3.0, 2).tolist()
        wanted = loop.platform(q, v, loop.acceleration(q, v, np.array([tau1, 0.0, tau2, 0.0])))[2]
        found = direct_dynamics_of_platform(robot, state, tau1, tau2, 0.0, 0.0)
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=TOLERANCE * largest(state, wanted))


def test_inverse_dynamics_is_pinocchios(
    robot: FiveBar, loop: ClosedLoop, regular_states: States, joint_vectors: Vectors
) -> None:
    random = np.random.default_rng(35)
    for state in regular_states(400, 36):
        q, v = joint_vectors(state)
        a = loop.acceleration(q, v, np.array([random.uniform(-3, 3), 0.0, random.uniform(-3, 3), 0.0]))
        wanted = loop.inverse_dynamics(q, v, a)
        found = inverse_dynamics(robot, state, float(a[0]), float(a[2]), 0.0, 0.0)
        tolerance = TOLERANCE * np.abs(wanted).max()
        np.testing.assert_allclose(found, wanted, rtol=0.0, atol=tolerance)
        ax, ay = loop.platform(q, v, a)[2].tolist()
        again = inverse_dynamics_of_platform(robot, state, ax, ay, 0.0, 0.0)
        np.testing.assert_allclose(again, wanted, rtol=0.0, atol=tolerance)


def test_friction_adds_to_the_inverse_and_takes_from_the_direct_torque(robot: FiveBar, regular_states: States) -> None:
    for state in regular_states(20, 37):
        plain = inverse_dynamics(robot, state, 3.0, -4.0, 0.0, 0.0)
        rubbing = inverse_dynamics(robot, state, 3.0, -4.0, 0.3, -0.5)
        np.testing.assert_allclose(np.subtract(rubbing, plain), (0.3, -0.5), atol=1e-12)
        driven = direct_dynamics(robot, state, 1.0, 2.0, 0.3, -0.5)
        assert driven == direct_dynamics(robot, state, 0.7, 2.5, 0.0, 0.0)
        platform = direct_dynamics_of_platform(robot, state, 1.0, 2.0, 0.3, -0.5)
        assert platform == direct_dynamics_of_platform(robot, state, 0.7, 2.5, 0.0, 0.0)


@ON_THE_LOCUS
def test_multipliers_of_the_direct_model_meet_both_equations(
    where: str, robot: FiveBar, regular_states: States, locus_states: States, matrices: Matrices
) -> None:
    """tau = ZZ qddot + B lambda + f and A^T lambda = m xddot, with matrices."""
    zz = np.diag([robot.leg1.inertia, robot.leg2.inertia])
    for state in (regular_states if where == "regular" else locus_states)(100, 38):
        a, b = matrices(state)
        motion = direct_dynamics(robot, state, 1.5, -0.7, 0.2, 0.1)
        lambdas = np.array([motion.lambda1, motion.lambda2])
        torque = zz @ (motion.ddq11, motion.ddq21) + b @ lambdas + (0.2, 0.1)
        np.testing.assert_allclose(torque, (1.5, -0.7), atol=1e-12)
        np.testing.assert_allclose(a.T @ lambdas, robot.mass * np.array([motion.ax, motion.ay]), atol=1e-12)


def test_multipliers_solve_the_platforms_balance(robot: FiveBar, regular_states: States, matrices: Matrices) -> None:
    for state in regular_states(50, 39):
        a, _ = matrices(state)
        wanted = np.linalg.solve(a.T, robot.mass * np.array([2.0, -3.0]))
        np.testing.assert_allclose(multipliers(robot, state, 2.0, -3.0), wanted, rtol=1e-12, atol=1e-12)


@ON_THE_LOCUS
def test_platform_model_has_the_matrices_of_its_docstring(
    where: str, robot: FiveBar, regular_states: States, locus_states: States, matrices: Matrices
) -> None:
    zz = np.diag([robot.leg1.inertia, robot.leg2.inertia])
    for state in (regular_states if where == "regular" else locus_states)(50, 40):
        a, b = matrices(state)
        n = np.linalg.solve(b, a)
        c = np.array(
            [
                leg.distal * at.dtheta**2 + leg.proximal * math.cos(at.q2) * at.dq1**2
                for leg, at in ((robot.leg1, state.leg1), (robot.leg2, state.leg2))
            ]
        )
        model = platform_model(robot, state)
        mass = np.array([[model.m_xx, model.m_xy], [model.m_xy, model.m_yy]])
        np.testing.assert_allclose(mass, robot.mass * np.eye(2) + n.T @ zz @ n, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose((model.h_x, model.h_y), n.T @ zz @ np.linalg.solve(b, c), rtol=1e-10, atol=1e-10)
        np.testing.assert_allclose([[model.n1_x, model.n1_y], [model.n2_x, model.n2_y]], n, rtol=1e-12, atol=1e-12)
        assert np.linalg.eigvalsh(mass)[0] >= robot.mass * (1.0 - 1e-12)


@ON_THE_LOCUS
def test_power_of_the_motors_is_the_rate_of_the_energy(
    where: str, robot: FiveBar, loop: ClosedLoop, regular_states: States, locus_states: States, joint_vectors: Vectors
) -> None:
    """(tau - f) . qdot = dT/dt, with T from Pinocchio, differenced along the motion that the model predicts."""
    h = 1e-5
    for fast in (regular_states if where == "regular" else locus_states)(50, 41):
        mode = working_mode(fast)
        state = state_from_platform(robot, mode, fast.x, fast.y, 0.3 * fast.vx, 0.3 * fast.vy)
        motion = direct_dynamics(robot, state, 0.8, -0.6, 0.1, 0.05)

        def energy(t: float, state: State = state, motion: DynamicResponse = motion, mode: WorkingMode = mode) -> float:
            later = state_from_platform(
                robot,
                mode,
                state.x + state.vx * t + 0.5 * motion.ax * t * t,
                state.y + state.vy * t + 0.5 * motion.ay * t * t,
                state.vx + motion.ax * t,
                state.vy + motion.ay * t,
            )
            return loop.kinetic_energy(*joint_vectors(later))

        power = 0.7 * state.leg1.dq1 - 0.65 * state.leg2.dq1
        assert (energy(h) - energy(-h)) / (2.0 * h) == pytest.approx(power, rel=1e-5, abs=1e-5)


def test_no_torque_acts_along_t_s_on_the_locus(
    robot: FiveBar, loop: ClosedLoop, locus_states: States, joint_vectors: Vectors
) -> None:
    """The dynamic criterion (1.19, 4.21) holds by itself: m t_s . xddot = 0 whatever the motors do."""
    random = np.random.default_rng(42)
    for state in locus_states(100, 43):
        svd = parallel_svd(state)
        q, v = joint_vectors(state)
        for tau1, tau2 in random.uniform(-20.0, 20.0, (5, 2)).tolist():
            motion = direct_dynamics(robot, state, tau1, tau2, 0.0, 0.0)
            # what cancels are the forces along the distal links
            forces = math.hypot(motion.lambda1, motion.lambda2)
            assert robot.mass * abs(svd.t_x * motion.ax + svd.t_y * motion.ay) < 1e-13 * forces
            true = loop.platform(q, v, loop.acceleration(q, v, np.array([tau1, 0.0, tau2, 0.0])))[2]
            assert robot.mass * abs(svd.t_x * true[0] + svd.t_y * true[1]) < 1e-12 * forces


def test_the_same_torque_moves_the_platform_across_t_s_away_from_the_locus(robot: FiveBar) -> None:
    """The criterion is a property of the locus, not of the model: 20 mm away it fails."""
    state = state_from_platform(robot, (1, -1), 0.0, 0.13, 0.0, 0.0)
    svd = parallel_svd(state)
    motion = direct_dynamics(robot, state, 1.0, 1.0, 0.0, 0.0)
    assert abs(svd.t_x * motion.ax + svd.t_y * motion.ay) > 0.1


def exactly_on_locus(robot: FiveBar) -> State:
    return state_from_joints(robot, 1.0, -1.0, 2.0, -2.0, 0.3, 0.0, 0.4, 0.0)


def test_inverse_models_are_undefined_on_the_locus(robot: FiveBar) -> None:
    state = exactly_on_locus(robot)
    for numbers in (
        multipliers(robot, state, 1.0, 1.0),
        inverse_dynamics(robot, state, 1.0, 1.0, 0.0, 0.0),
        inverse_dynamics_of_platform(robot, state, 1.0, 1.0, 0.0, 0.0),
    ):
        assert all(math.isnan(number) for number in numbers)
    assert all(math.isfinite(number) for number in direct_dynamics(robot, state, 1.0, 1.0, 0.0, 0.0))


def test_platform_form_is_undefined_at_type_1(robot: FiveBar) -> None:
    state = state_from_joints(robot, 1.0, 0.0, 1.0, 1.2, 0.3, 0.2, 0.4, 0.1)
    assert all(math.isnan(number) for number in platform_model(robot, state))
    assert all(math.isnan(number) for number in direct_dynamics_of_platform(robot, state, 1.0, 1.0, 0.0, 0.0))
    assert all(math.isfinite(number) for number in direct_dynamics(robot, state, 1.0, 1.0, 0.0, 0.0))


def test_direct_dynamics_is_undefined_only_at_type_3(robot: FiveBar) -> None:
    """Both legs stretched along one line: the motors hold nothing of the platform."""
    both = state_from_joints(robot, 0.0, 0.0, 0.0, 0.0, 0.1, 0.0, 0.2, 0.0)
    assert all(math.isnan(number) for number in direct_dynamics(robot, both, 1.0, 1.0, 0.0, 0.0))
    one = state_from_joints(robot, 0.0, 0.0, 1.0, -1.0, 0.1, 0.0, 0.2, 0.0)
    assert all(math.isfinite(number) for number in direct_dynamics(robot, one, 1.0, 1.0, 0.0, 0.0))


def test_the_constraint_form_closes_the_loop_under_any_drive_and_push(
    robot: FiveBar, regular_states: States, matrices: Matrices
) -> None:
    """ZZ (qddot - drive) = -B lambda, m (xddot - push) = A^T lambda and A xddot + c = B qddot, with matrices."""
    drive, push = np.array([30.0, -20.0]), np.array([3.0, -5.0])
    zz = np.diag([robot.leg1.inertia, robot.leg2.inertia])
    for state in regular_states(20, 44):
        a, b = matrices(state)
        c = np.array([state.leg1.c, state.leg2.c])
        right = (b @ drive - a @ push - c).tolist()
        found = response_to(constraint_form(robot, state), state, *drive.tolist(), Pushed(*right, *push.tolist()))
        qddot, xddot = np.array(found[:2]), np.array(found[2:4])
        lambdas = np.array(found[4:])
        np.testing.assert_allclose(zz @ (qddot - drive), -b @ lambdas, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(robot.mass * (xddot - push), a.T @ lambdas, rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(a @ xddot + c, b @ qddot, rtol=0.0, atol=1e-9)
