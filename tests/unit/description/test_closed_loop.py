# SPDX-License-Identifier: Apache-2.0
"""Pinocchio's closed loop: its gap, Jacobian, projection and energy against plain geometry and finite differences.

Its accelerations are compared with the reduced model in tests/unit/control/model/test_dynamics.py.
"""

from __future__ import annotations

import cmath
from collections.abc import Callable

import numpy as np
import pytest

from fivebar_control.model.state import State
from fivebar_description.closed_loop import ClosedLoop, Vector
from fivebar_description.parameters import FiveBar

States = Callable[[int, int], list[State]]
Vectors = Callable[[State], tuple[Vector, Vector]]


def tips(robot: FiveBar, q: Vector) -> tuple[complex, complex]:
    """Both chains' ends as complex numbers."""
    ends = [
        leg.base_x + leg.proximal * cmath.exp(1j * q1) + leg.distal * cmath.exp(1j * (q1 + q2))
        for leg, q1, q2 in ((robot.leg1, q[0], q[1]), (robot.leg2, q[2], q[3]))
    ]
    return ends[0], ends[1]


def test_gap_is_the_vector_between_the_tips(robot: FiveBar, loop: ClosedLoop) -> None:
    for q in np.random.default_rng(1).uniform(-3.0, 3.0, (50, 4)):
        tip1, tip2 = tips(robot, q)
        gap = loop.tip_gap(q).gap
        assert abs(complex(*gap) - (tip1 - tip2)) < 1e-15


def test_jacobian_of_the_gap_against_differences(robot: FiveBar, loop: ClosedLoop) -> None:
    h = 1e-7
    for q in np.random.default_rng(2).uniform(-3.0, 3.0, (50, 4)):
        jacobian = loop.tip_gap(q).jacobian
        for column, step in enumerate(np.eye(4) * h):
            ahead, behind = loop.tip_gap(q + step).gap, loop.tip_gap(q - step).gap
            np.testing.assert_allclose(jacobian[:, column], (ahead - behind) / (2.0 * h), atol=1e-9)


def test_closing_is_a_newton_step_and_an_orthogonal_projection(
    regular_states: States, loop: ClosedLoop, joint_vectors: Vectors
) -> None:
    random = np.random.default_rng(3)
    for state in regular_states(40, 3):
        q, v = joint_vectors(state)
        opened = q + random.uniform(-1e-4, 1e-4, 4)
        velocity = v + random.uniform(-1.0, 1.0, 4)
        closed, projected, gap = loop.close(opened, velocity)
        jacobian = loop.tip_gap(opened).jacobian
        assert gap == pytest.approx(np.linalg.norm(loop.tip_gap(opened).gap), rel=1e-14)
        # quadratic convergence: 1e-4 rad off leaves about (1e-4)^2 times a link length
        assert np.linalg.norm(loop.tip_gap(closed).gap) < 1e-8
        np.testing.assert_allclose(closed - opened, -np.linalg.pinv(jacobian) @ loop.tip_gap(opened).gap, atol=1e-16)
        null = np.eye(4) - np.linalg.pinv(jacobian) @ jacobian
        np.testing.assert_allclose(projected, null @ velocity, atol=1e-13)


def test_closing_leaves_a_closed_state_alone(locus_states: States, loop: ClosedLoop, joint_vectors: Vectors) -> None:
    for state in locus_states(20, 4):
        q, v = joint_vectors(state)
        closed, projected, gap = loop.close(q, v)
        assert gap < 1e-15
        np.testing.assert_allclose(closed, q, atol=1e-14)
        np.testing.assert_allclose(projected, v, rtol=1e-12, atol=1e-12)


def test_energy_is_that_of_two_rotors_and_a_point_mass(
    robot: FiveBar, loop: ClosedLoop, regular_states: States, joint_vectors: Vectors
) -> None:
    for state in regular_states(40, 5):
        rotors = 0.5 * robot.leg1.inertia * state.leg1.dq1**2 + 0.5 * robot.leg2.inertia * state.leg2.dq1**2
        platform = 0.5 * robot.mass * (state.vx**2 + state.vy**2)
        assert loop.kinetic_energy(*joint_vectors(state)) == pytest.approx(rotors + platform, rel=1e-12)


def test_inverse_dynamics_undoes_the_direct_dynamics(
    loop: ClosedLoop, regular_states: States, joint_vectors: Vectors
) -> None:
    random = np.random.default_rng(6)
    for state in regular_states(100, 6):
        q, v = joint_vectors(state)
        tau = random.uniform(-3.0, 3.0, 2)
        acceleration = loop.acceleration(q, v, np.array([tau[0], 0.0, tau[1], 0.0]))
        np.testing.assert_allclose(loop.inverse_dynamics(q, v, acceleration), tau, atol=1e-9)


def test_there_is_no_gravity(loop: ClosedLoop, regular_states: States, joint_vectors: Vectors) -> None:
    for state in regular_states(8, 7):
        q, _ = joint_vectors(state)
        np.testing.assert_allclose(loop.acceleration(q, np.zeros(4), np.zeros(4)), np.zeros(4), atol=1e-12)
