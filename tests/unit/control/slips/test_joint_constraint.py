# SPDX-License-Identifier: Apache-2.0
"""Slips in the constraint with joint variables: 3.14 to 3.19, and 3.19 as repeated in 4.1.1."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.optimize import brentq
from slip_cases import CENTRE_Y, FRICTION, MASS, MODE, ROBOT, ZZ, Vector, beside, case, centre, pinocchio_motion

from fivebar_control.laws.gains import RESOLUTIONS
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.laws.vhc_joint import path_constraints, vhc_joint_torque
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import det_a
from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform


def phi(y: float) -> Vector:
    angles = inverse_geometry(ROBOT, MODE, 0.0, y)
    return np.array([angles.q11, angles.q21])


def phi_derivatives(y: float) -> tuple[Vector, Vector]:
    h = 1e-4
    return (phi(y + h) - phi(y - h)) / (2.0 * h), (phi(y + h) - 2.0 * phi(y) + phi(y - h)) / h**2


def test_the_pseudo_inverse_below_3_14_loses_the_crossing_velocity() -> None:
    """The motors stand still at the centre, so (B^-1 A)^+ qdot is 0 where the platform has 0.3 m/s; so is the drift."""
    at = centre()
    assert np.abs(at.q_dot).max() < 1e-14
    recovered = np.linalg.pinv(np.linalg.solve(at.b, at.a), rcond=1e-9) @ at.q_dot
    assert np.linalg.norm(recovered) < 1e-15
    assert np.linalg.norm(at.x_dot) == 0.3
    # what b(y) of 3.14 should have been
    np.testing.assert_allclose(at.drift, (-11.8354, 11.8354), atol=1e-4)
    np.testing.assert_allclose(pinocchio_motion(at.state, ZZ @ at.drift)[0], at.drift, atol=1e-10)


def test_the_mass_in_3_15_and_3_16_has_a_plus() -> None:
    """Asked for 3 m/s^2 the printed torque gives (J - m)/(J + m) = 0.755 of it; the same minus is in 3.19."""
    at = centre()
    row = np.linalg.solve(at.b, np.array([1.0, -1.0]))
    q_ddot = 3.0 * row + at.drift
    (x_ddot,) = np.linalg.pinv(row[:, None]) @ (q_ddot - at.drift)
    assert x_ddot == pytest.approx(3.0, abs=1e-12)
    found = {
        sign: float(pinocchio_motion(at.state, row * (row @ ZZ @ q_ddot + sign * MASS * x_ddot) / (row @ row))[1][0])
        for sign in (-1.0, 1.0)
    }
    assert found[1.0] == pytest.approx(3.0, abs=1e-10)
    assert found[-1.0] == pytest.approx(0.7553 * 3.0, abs=1e-3)


def test_the_friction_of_3_15_is_a_vector_among_scalars() -> None:
    """A^T B^-T f has two components, A_s B^-T f one (3.15, 3.16, 3.19, 3.28, 3.31 to 3.35)."""
    at = beside()
    a_s = at.a @ at.a[0]
    row = np.linalg.solve(at.b, a_s)
    printed = at.a.T @ np.linalg.solve(at.b, FRICTION)
    assert printed.shape == (2,)
    assert (row[:, None] / (row @ row) @ printed[None, :]).shape == (2, 2)
    scalar = row @ FRICTION
    assert scalar == pytest.approx(-6.05, abs=0.01)
    # and its first component is the scalar times cos(beta), right only where beta = 0
    assert printed[0] == pytest.approx(0.9059 * scalar, abs=1e-3)
    for friction, error in ((scalar, 0.0), (printed[0], 0.0530)):
        tau = row * (row @ ZZ @ at.drift + friction) / (row @ row)
        x_ddot = pinocchio_motion(at.state, tau - FRICTION)[1]
        assert np.linalg.norm(x_ddot) == pytest.approx(error, abs=1e-4)


def test_3_17_drops_a_term_that_3_3_has() -> None:
    """hddot of leg 1 by differences, 5 mm above the locus with yddot = 2 m/s^2: 3.17 is off by 1.28 rad/s^2."""
    y, speed, lift, push, step = CENTRE_Y + 0.005, -0.3, 2.0, 1.0, 1e-4

    def place(t: float) -> tuple[float, float]:
        return 0.5 * push * t * t, y + speed * t + 0.5 * lift * t * t

    def h_1(t: float) -> float:
        x, along = place(t)
        return inverse_geometry(ROBOT, MODE, x, along).q11 - float(phi(along)[0])

    h_ddot = (h_1(step) - 2.0 * h_1(0.0) + h_1(-step)) / step**2
    at = case(0.0, y, 0.0, speed)
    q_ddot = (np.linalg.solve(at.b, at.a @ (push, lift)) + at.drift)[0]
    slope, bend = (both[0] for both in phi_derivatives(y))
    assert q_ddot - bend * speed**2 - slope * lift == pytest.approx(h_ddot, abs=1e-3)
    assert q_ddot - bend * speed**2 - h_ddot == pytest.approx(slope * lift, abs=1e-3)
    assert slope * lift == pytest.approx(-1.2774, abs=1e-3)


def test_without_that_term_an_oblique_path_is_held_with_less_than_the_gain() -> None:
    """In the posture of 3.45, at rest 10 um beside a vertical path: 0.821 of Kp h as 3.17 has it, all of it by 3.3."""
    moving = beside().state
    at = case(moving.x, moving.y, 0.0, 0.0)
    off, kp = 1e-5, 2500.0
    line = Line(moving.x - off, moving.y + 0.05, 0.0, -1.0)
    v = np.array([-kp * one.h for one in path_constraints(ROBOT, MODE, at.state, line)])
    v1, d = at.a[0], np.array([0.0, -1.0])
    row = np.linalg.solve(at.b, at.a @ v1)
    slope = np.linalg.solve(at.b, at.a @ d)
    pull = {}
    for name, column in (("3.17", row), ("3.3", row - slope * (d @ v1))):
        alpha = float(column @ v / (column @ column))
        q_ddot = row * alpha
        tau = row / (row @ row) * (row @ ZZ @ q_ddot + MASS * alpha)
        pull[name] = float(pinocchio_motion(at.state, tau)[1][0]) / (-kp * off)
    assert pull["3.17"] == pytest.approx(0.9059**2, abs=1e-3)
    assert pull["3.3"] == pytest.approx(1.0, abs=1e-3)


def test_qddot_of_3_18_is_not_hddot() -> None:
    """On the path at 0.3 m/s the motors must turn with phi'' ydot^2 = 11.8 rad/s^2 while v_1 = hddot = 0.

    Taking qddot = v_1 leaves a constant h = -phi'' ydot^2 / Kp: 4.7 mrad at Kp = 2500 / s^2.
    """
    at = centre()
    bend = phi_derivatives(at.state.y)[1] * 0.3**2
    np.testing.assert_allclose(bend, (-11.8354, 11.8354), atol=1e-2)
    straight_on = pinocchio_motion(at.state, ZZ @ at.drift)
    assert np.linalg.norm(straight_on[1]) < 1e-10
    np.testing.assert_allclose(straight_on[0], bend, atol=1e-2)
    assert np.abs(bend / 2500.0).max() == pytest.approx(4.73e-3, abs=1e-5)
    reference = reference_from_platform(ROBOT, MODE, Platform(0.0, at.state.y, 0.0, -0.3, 0.0, 0.0))
    line, resolve = Line(0.0, 0.15, 0.0, -1.0), RESOLUTIONS["full_inverse"]
    torque = vhc_joint_torque(ROBOT, MODE, at.state, reference, line, 2500.0, 100.0, resolve)
    net = np.array([torque.tau1 - reference.f1, torque.tau2 - reference.f2])
    np.testing.assert_allclose(np.linalg.solve(ZZ, net), at.drift, atol=1e-9)


def held_by(speed: float, y_near: float, x: float, angle: float) -> tuple[float, float]:
    """Stiffness across a path over Kp where it meets the locus, as 3.18 asks and by the joint law.

    3.18 is taken with S25, S27 and S28 mended, the torque such that the platform gets alpha v1 exactly.
    """
    y = float(brentq(lambda y: det_a(case(x, y, 0.0, 0.0).state), y_near - 2e-3, y_near + 2e-3, xtol=1e-17))
    kp, kd, off = 2500.0, 100.0, 1e-6
    d = np.array([math.cos(angle), math.sin(angle)])
    n = np.array([d[1], -d[0]])
    line, (vx, vy) = Line(x, y, *d.tolist()), (speed * d).tolist()
    reference = reference_from_platform(ROBOT, MODE, Platform(x, y, vx, vy, 0.0, 0.0))
    friction = np.array([reference.f1, reference.f2])
    bend = case(x, y, vx, vy).drift

    def pulled(off: float) -> tuple[float, float]:
        aside_x, aside_y = (np.array([x, y]) + off * n).tolist()
        at = case(aside_x, aside_y, vx, vy)
        both = path_constraints(ROBOT, MODE, at.state, line)
        left, values, right = np.linalg.svd(at.a)
        column = np.linalg.solve(at.b, at.a @ right[0])
        asked = column - np.array([one.slope for one in both]) * (d @ right[0])
        v = bend + np.array([-kp * one.h - kd * one.dh for one in both])
        alpha = float(asked @ (v - at.drift) / (asked @ asked))
        printed = ZZ @ (column * alpha + at.drift) + at.b @ left[:, 0] * (MASS * alpha / values[0])
        torque = vhc_joint_torque(ROBOT, MODE, at.state, reference, line, kp, kd, RESOLUTIONS["full_inverse"])
        mended = np.array(torque) - friction
        return float(n @ pinocchio_motion(at.state, printed)[1]), float(n @ pinocchio_motion(at.state, mended)[1])

    before, after = pulled(-off), pulled(off)
    return (before[0] - after[0]) / (2.0 * off * kp), (before[1] - after[1]) / (2.0 * off * kp)


def test_gains_on_h_of_3_18_are_not_gains_on_the_distance_from_the_path() -> None:
    """h_i = p_i(s) eps: what 3.18 asks of h leaves eps without stiffness where p shrinks along the path.

    At the centre 1.05 of Kp at 0.3 m/s; on an oblique path through the locus at (40, -13) mm 0.12, and at 0.4 m/s less
    than nothing.
    """
    printed, law = held_by(0.3, CENTRE_Y, 0.0, -0.5 * math.pi)
    assert printed == pytest.approx(1.0489, abs=1e-3)
    assert law == pytest.approx(1.0, abs=1e-4)
    oblique = {speed: held_by(speed, -0.0127, 0.04, 5.7) for speed in (0.01, 0.3, 0.4)}
    assert oblique[0.01][0] == pytest.approx(0.9786, abs=1e-3)
    assert oblique[0.3][0] == pytest.approx(0.120, abs=2e-3)
    assert oblique[0.4][0] < 0.0
    assert [law for _, law in oblique.values()] == pytest.approx([1.0] * 3, abs=1e-4)


def test_the_brackets_of_3_19_add_a_vector_to_a_scalar() -> None:
    """The row must multiply v_1 + Phi'' ydot^2; so mended, with the signs of 3.15 and 3.18, it is the joint law.

    But for S47: with the platform drifting aside, the motors' own drift takes the place of Phi'' ydot^2.
    """
    at = case(0.0, CENTRE_Y, 0.02, -0.3)
    row = np.linalg.solve(at.b, np.array([1.0, -1.0]))
    reference = reference_from_platform(ROBOT, MODE, Platform(0.0, at.state.y, 0.0, -0.3, 0.0, 0.0))
    f = np.array([reference.f1, reference.f2])
    line = Line(0.0, 0.15, 0.0, -1.0)
    both = path_constraints(ROBOT, MODE, at.state, line)
    v_1 = np.array([-2500.0 * one.h - 100.0 * one.dh for one in both])
    bend = phi_derivatives(at.state.y)[1] * 0.3**2
    back = np.linalg.pinv(row[:, None])[0]
    bracket = row @ ZZ + MASS * back
    drifting = at.drift - bend
    mended = row / (row @ row) * (bracket @ (v_1 + bend + drifting) - MASS * back @ at.drift + row @ f)
    wanted = vhc_joint_torque(ROBOT, MODE, at.state, reference, line, 2500.0, 100.0, RESOLUTIONS["min_norm"])
    np.testing.assert_allclose(mended, wanted, atol=1e-5)
    assert (bracket @ v_1).shape == ()
    assert bend.shape == (2,)
    # numpy would let it pass and give motor 1 another sum than motor 2
    printed = row / (row @ row) * (bracket @ (v_1 + drifting) + bend - MASS * back @ at.drift + row @ f)
    assert np.abs(printed - wanted).max() == pytest.approx(0.5, abs=0.01)


def test_the_repetition_of_3_19_has_one_pseudo_inverse_too_many() -> None:
    """4.1.1 prints (row)^+ v_1: a column times a column. (Its last bracket is never closed, either.)"""
    at = centre()
    row = np.linalg.solve(at.b, np.array([[1.0], [-1.0]])).T
    bracket = row @ ZZ + MASS * np.linalg.pinv(row.T)
    v_1 = np.array([[3.0], [-3.0]])
    assert (bracket @ v_1).shape == (1, 1)
    with pytest.raises(ValueError, match="mismatch"):
        np.linalg.pinv(bracket) @ v_1
