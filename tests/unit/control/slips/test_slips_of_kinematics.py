# SPDX-License-Identifier: Apache-2.0
"""Slips in the kinematic relations: 1.1, 1.3, 1.15 against 1.26, 3.5 to 3.8, 3.12 against 3.30."""

from __future__ import annotations

import math

import numpy as np
import pinocchio as pin
import pytest
from slip_cases import BASE, LINK, LOOP, MASS, MODE, ROBOT, ZZ, Vector, away, beside, centre, joints, pinocchio_motion

from fivebar_control.model.geometry import inverse_geometry


def test_closure_of_1_1_has_a_minus_between_its_terms() -> None:
    """With the matrices under 1.31, A xdot + B qdot = 0 is off by 0.75 m/s, A xdot - B qdot = 0 by rounding."""
    at = away()
    q, v = joints(at.state)
    velocity = LOOP.platform(q, v, np.zeros(4))[1]
    motors = v[[0, 2]]
    assert np.linalg.norm(at.a @ velocity + at.b @ motors) == pytest.approx(0.7520, abs=1e-4)
    assert np.linalg.norm(at.a @ velocity - at.b @ motors) < 1e-14


def matrices_of_3_5(y: float) -> tuple[Vector, Vector]:
    """A and B as printed under 3.5, for x = 0."""
    phi = inverse_geometry(ROBOT, MODE, 0.0, y)
    rows, diagonal = [], []
    for angle, base in ((phi.q11, BASE / 2.0), (phi.q21, -BASE / 2.0)):
        row = (base - LINK * math.cos(angle), y - LINK * math.sin(angle))
        rows.append(row)
        diagonal.append(-LINK * row[0] * math.sin(angle) + LINK * row[1] * math.cos(angle))
    return np.array(rows), np.diag(diagonal)


def test_slope_of_the_constraint_in_3_6_is_plus_b_inverse_a() -> None:
    """The second column of B^-1 A is phi', by central differences; 3.6 has it with the other sign."""
    y, h = 0.12, 1e-6
    ahead, behind = (inverse_geometry(ROBOT, MODE, 0.0, y + step) for step in (h, -h))
    slope = np.array([ahead.q11 - behind.q11, ahead.q21 - behind.q21]) / (2.0 * h)
    a, b = matrices_of_3_5(y)
    np.testing.assert_allclose(np.linalg.solve(b, a)[:, 1], slope, rtol=1e-8)
    assert slope[0] == pytest.approx(-4.148, abs=1e-3)
    assert -np.linalg.solve(b, a)[0, 1] == pytest.approx(4.148, abs=1e-3)


def test_matrices_under_3_5_carry_a_link_length_that_a_s_does_not() -> None:
    """Rows of length l instead of 1: mixed with A_s = (1, -1), they make the platform eleven times too light."""
    at = centre()
    a, b = matrices_of_3_5(at.state.y)
    np.testing.assert_allclose(a, LINK * at.a, atol=1e-15)
    np.testing.assert_allclose(b, LINK * at.b, atol=1e-15)
    a_s = np.array([1.0, -1.0])
    wanted = 3.0
    q_ddot = np.linalg.solve(at.b, a_s) * wanted + at.drift
    found = {}
    for name, serial in (("mixed", b), ("unit", at.b)):
        row = np.linalg.solve(serial, a_s)
        tau = row * (row @ ZZ @ q_ddot + MASS * wanted) / (row @ row)
        found[name] = pinocchio_motion(at.state, tau)[1][0]
    assert found["unit"] == pytest.approx(wanted, abs=1e-9)
    # (J + l m) / (J + m) with J = 3.852 kg, the motors' inertia seen by the platform
    assert found["mixed"] == pytest.approx(2.666, abs=1e-3)


def test_transfer_of_the_twist_in_1_3_needs_minus_the_cross_product_matrix() -> None:
    """1.2 adds omega x r; in matrix form that is -[r]x omega, and a bare vector r has not even the shape."""
    random = np.random.default_rng(1)
    r, velocity, omega = random.uniform(-1.0, 1.0, (3, 3))
    wanted = velocity + np.cross(omega, r)
    cross = np.array([[0.0, -r[2], r[1]], [r[2], 0.0, -r[0]], [-r[1], r[0], 0.0]])
    np.testing.assert_allclose(velocity - cross @ omega, wanted, atol=1e-15)
    assert np.linalg.norm(velocity + cross @ omega - wanted) == pytest.approx(2.0 * np.linalg.norm(np.cross(omega, r)))
    with pytest.raises(ValueError, match="dimension"):
        np.hstack([np.eye(3), r])


def test_rates_of_three_angles_are_not_the_angular_velocity_that_1_2_takes() -> None:
    """Section 1.2 writes t as the derivative of (x, y, z, phi, psi, theta); the planar five-bar does not notice."""
    angles, rates, h = np.array([0.4, -0.7, 0.3]), np.array([0.5, 0.2, -0.9]), 1e-6
    ahead, behind = (pin.rpy.rpyToMatrix(angles + step * rates) for step in (h, -h))
    spin = (ahead - behind) / (2.0 * h) @ pin.rpy.rpyToMatrix(angles).T
    omega = np.array([spin[2, 1], spin[0, 2], spin[1, 0]])
    assert np.linalg.norm(omega - rates) == pytest.approx(0.3900, abs=1e-3)
    only_z = np.array([0.0, 0.0, -0.9])
    turned = (pin.rpy.rpyToMatrix(h * only_z) - pin.rpy.rpyToMatrix(-h * only_z)) / (2.0 * h)
    assert turned[1, 0] == pytest.approx(-0.9, abs=1e-9)


def test_jacobian_of_1_26_has_the_wrong_sign_for_1_30_and_that_of_1_15_the_right_one() -> None:
    """tau = ZZ qddot + J^T w_p against the torque that made Pinocchio's motion."""
    at = away()
    tau = np.array([0.8, -0.5])
    q_ddot, x_ddot = pinocchio_motion(at.state, tau)
    platform = at.b @ np.linalg.solve(at.a.T, MASS * x_ddot)
    np.testing.assert_allclose(ZZ @ q_ddot + platform, tau, atol=1e-12)
    assert np.linalg.norm(ZZ @ q_ddot - platform - tau) == pytest.approx(1.0939, abs=1e-3)


def test_section_1_2_agrees_with_1_26_and_not_with_the_words_below_1_15() -> None:
    """1.7 to 1.14 give 1.15 with J = -A^-1 B, the sign that belongs to 1.1; with A^-1 B they do not."""
    random = np.random.default_rng(2)
    a, b = random.uniform(-1.0, 1.0, (2, 2, 2))
    j_t, j_ta = random.uniform(-1.0, 1.0, (2, 3, 2))
    j_td = random.uniform(-1.0, 1.0, (3, 3))
    active, wrench, passive = random.uniform(-1.0, 1.0, 2), random.uniform(-1.0, 1.0, 2), random.uniform(-1.0, 1.0, 3)
    lambda_2 = np.linalg.solve(j_td.T, passive)
    lambda_1 = np.linalg.solve(a.T, wrench + j_t.T @ lambda_2)
    tau = active - b.T @ lambda_1 - j_ta.T @ lambda_2
    off = {}
    for sign in (-1.0, 1.0):
        j = sign * np.linalg.solve(a, b)
        j_d = np.linalg.solve(j_td, j_t @ j - j_ta)
        off[sign] = float(np.linalg.norm(active + j.T @ wrench + j_d.T @ passive - tau))
    assert off[-1.0] < 1e-13
    assert off[1.0] > 0.1


def test_inverse_jacobians_of_3_12_and_3_30_have_opposite_signs() -> None:
    """J^-T = A^T B^-T in 3.12 means J^-1 = B^-1 A; J_s^-1 = -B^-1 A_s^T below 3.30 is its opposite along v1."""
    at = beside()
    v1 = at.a[0]
    a_s = at.a @ v1
    of_3_12 = (at.a.T @ np.linalg.inv(at.b).T).T @ v1
    of_3_30 = -np.linalg.solve(at.b, a_s)
    np.testing.assert_allclose(of_3_30, -of_3_12, rtol=1e-12)
    moving = away()
    motors = joints(moving.state)[1][[0, 2]]
    np.testing.assert_allclose(np.linalg.solve(moving.b, moving.a) @ moving.x_dot, motors, rtol=1e-12)


def test_drift_of_3_8_has_one_sign_wrong_in_front_and_one_inside() -> None:
    """The printed qddot is off by 58 rad/s^2, B^-1 (A xddot + Adot xdot - Bdot qdot) by nothing."""
    at = away()
    q_ddot, x_ddot = pinocchio_motion(at.state, np.array([0.8, -0.5]))
    mended = np.linalg.solve(at.b, at.a @ x_ddot) + at.drift
    printed = -np.linalg.solve(at.b, at.a @ x_ddot + at.a_dot @ at.x_dot + at.b_dot @ at.q_dot)
    np.testing.assert_allclose(mended, q_ddot, atol=1e-10)
    assert np.linalg.norm(printed - q_ddot) == pytest.approx(58.38, abs=0.01)
    # turning B round, as 3.5 would have it, mends 3.8 but breaks the + B^T lambda of 3.9
    turned = -np.linalg.solve(-at.b, at.a @ x_ddot + at.a_dot @ at.x_dot - at.b_dot @ at.q_dot)
    np.testing.assert_allclose(turned, q_ddot, atol=1e-10)
