# SPDX-License-Identifier: Apache-2.0
"""Slips in the model and in chapter 1's control laws: 1.19, 1.20 to 1.29, units, the words on Type 2."""

from __future__ import annotations

import math

import numpy as np
import pytest
from slip_cases import CENTRE_Y, FRICTION, MASS, MODE, ROBOT, ZZ, Vector, away, beside, case, centre, pinocchio_motion

from fivebar_control.laws.ctc import ctc_torque
from fivebar_control.laws.multi_model import reduced_ctc_torque
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.geometry import direct_geometry
from fivebar_control.model.kinematics import det_a
from fivebar_control.model.state import Platform
from fivebar_description.parameters import FiveBar, LegParameters, friction_torque


def test_both_assembly_modes_meet_at_type_2() -> None:
    """1.1.4 says that the robot cannot go from one to the other there: it is where they are 0 m apart."""

    def apart(q11: float, q21: float) -> float:
        return math.dist(direct_geometry(ROBOT, 1, q11, q21), direct_geometry(ROBOT, -1, q11, q21))

    near, off = case(0.0, CENTRE_Y + 1e-9, 0.0, 0.0).state, away().state
    assert apart(near.leg1.q1, near.leg2.q1) < 3e-9
    assert apart(off.leg1.q1, off.leg2.q1) == pytest.approx(0.0750, abs=1e-4)


def test_t_s_is_in_the_kernel_of_a_and_not_of_its_transpose() -> None:
    """Above 1.19; t_s^T A^T lambda = (A t_s)^T lambda vanishes for all lambda only where A t_s = 0."""
    at = centre()
    of_a = np.linalg.svd(at.a)[2][1]
    of_a_transposed = np.linalg.svd(at.a.T)[2][1]
    assert np.linalg.norm(at.a @ of_a) < 1e-15
    assert np.linalg.norm(at.a @ of_a_transposed) == pytest.approx(1.0, abs=1e-12)
    x_ddot = pinocchio_motion(at.state, np.array([1.0, 0.4]))[1]
    assert abs(MASS * of_a @ x_ddot) < 1e-12
    assert abs(MASS * of_a_transposed @ x_ddot) == pytest.approx(1.4226, abs=1e-3)


def test_friction_belongs_into_h_of_1_20_to_1_28() -> None:
    """1.30 has f; H as described in 1.20 has not, and the motors are then off by 30 rad/s^2."""
    at = away()
    state = at.state
    reference = reference_from_platform(ROBOT, MODE, Platform(state.x, state.y, state.vx, state.vy, 1.0, -2.0))
    f = np.array([reference.f1, reference.f2])
    mended = np.array(ctc_torque(ROBOT, state, reference, 2500.0, 100.0))
    wanted = np.linalg.solve(at.b, at.a @ (1.0, -2.0)) + at.drift
    np.testing.assert_allclose(pinocchio_motion(state, mended - f)[0], wanted, atol=1e-10)
    printed = mended - f
    assert np.linalg.norm(pinocchio_motion(state, printed - f)[0] - wanted) == pytest.approx(30.09, abs=0.01)


def test_computed_torque_does_not_converge_to_zero_with_a_wrong_model() -> None:
    """Below 1.23 convergence is claimed with an inaccurate model: an unknown 0.0855 Nm leaves e = M^-1 d / Kp."""
    at = case(0.0, 0.12, 0.0, 0.0)
    kp = 2500.0
    jacobian = np.linalg.solve(at.a, at.b)
    inertia = ZZ + MASS * jacobian.T @ jacobian
    disturbance = np.array([0.0855, 0.0])
    error = np.linalg.solve(inertia, disturbance) / kp
    assert np.linalg.norm(error) == pytest.approx(1.733e-3, abs=1e-6)
    # at rest in that distance the law's torque just holds the disturbance: the robot stays there
    torque = inertia @ (kp * error)
    assert np.abs(pinocchio_motion(at.state, torque - disturbance)[0]).max() < 1e-10


def test_a_vanished_wrench_does_not_make_the_multipliers_vanish_on_the_locus() -> None:
    """Below 1.26 lambda = 0 is drawn from w_p = 0: (1, 1) N in stretched links gives no wrench, but torques."""
    at = centre()
    inner = np.array([1.0, 1.0])
    assert np.linalg.norm(at.a.T @ inner) < 1e-15
    np.testing.assert_allclose(np.abs(at.b @ inner), 0.0845, atol=1e-4)


def test_the_transposed_jacobian_grows_at_the_locus_instead_of_vanishing() -> None:
    """The line above 1.27 calls J^T vanished: what vanishes is lambda, |J| grows as 1 / distance."""

    def size(gap: float) -> float:
        at = case(0.0, centre().state.y + gap, 0.0, 0.0)
        return float(np.linalg.norm(np.linalg.solve(at.a, at.b), 2))

    assert size(1e-3) == pytest.approx(5.41, abs=0.01)
    assert size(1e-6) == pytest.approx(1000.0 * size(1e-3), rel=0.05)


def test_feedforward_of_1_29_is_the_desired_acceleration_and_not_that_of_the_error() -> None:
    """On a criterion-meeting reference with no error, 1.29 asks for friction alone and the platform gets 0.62 m/s^2."""
    at = beside()
    state = at.state
    reference = reference_from_platform(ROBOT, MODE, Platform(state.x, state.y, state.vx, state.vy, 0.0, 0.0))
    f = np.array([reference.f1, reference.f2])
    mended = np.array(reduced_ctc_torque(ROBOT, state, reference, 2500.0, 100.0))
    np.testing.assert_allclose(mended, ZZ @ at.drift + f, atol=1e-12)
    assert np.linalg.norm(pinocchio_motion(state, mended - f)[1]) < 1e-9
    no_error = np.zeros(2)
    printed = ZZ @ no_error + f
    assert np.linalg.norm(pinocchio_motion(state, printed - f)[1]) == pytest.approx(0.6211, abs=1e-3)


def in_millimetres(robot: FiveBar, inertia_factor: float) -> FiveBar:
    def leg(one: LegParameters) -> LegParameters:
        return one._replace(
            base_x=1e3 * one.base_x,
            proximal=1e3 * one.proximal,
            distal=1e3 * one.distal,
            inertia=inertia_factor * one.inertia,
        )

    return FiveBar(leg(robot.leg1), leg(robot.leg2), robot.mass)


def motor_accelerations_in_millimetres(inertia_factor: float) -> Vector:
    robot = in_millimetres(ROBOT, inertia_factor)
    state = away().state
    leg1, leg2 = (one._replace(b=1e3 * one.b, c=1e3 * one.c) for one in (state.leg1, state.leg2))
    torque = 1e6 * np.array([0.8, -0.5])
    motion = direct_dynamics(robot, state._replace(leg1=leg1, leg2=leg2), *torque.tolist(), 0.0, 0.0)
    return np.array([motion.ddq11, motion.ddq21])


def test_inertias_are_in_kg_m2() -> None:
    """Motor accelerations do not depend on the unit of length if zz is kg m^2, and do if it is kg / m^2 (1.4.1)."""
    wanted = pinocchio_motion(away().state, np.array([0.8, -0.5]))[0]
    np.testing.assert_allclose(motor_accelerations_in_millimetres(1e6), wanted, rtol=1e-10)
    assert np.linalg.norm(motor_accelerations_in_millimetres(1e-6) - wanted) > 10.0


def test_friction_offset_is_in_nm() -> None:
    """1.32 adds f_off as it is: in ms it scales like a torque, 1e-6, and not like Nm s / rad, 1e-3 (1.4.1)."""
    leg = ROBOT.leg1
    wanted = 1e-6 * friction_torque(leg, 0.7)
    assert wanted == pytest.approx(1e-6 * (0.345 + 0.0855), rel=1e-12)
    in_ms = leg._replace(coulomb=1e-6 * leg.coulomb, width=1e-3 * leg.width)
    assert friction_torque(in_ms._replace(offset=1e-6 * leg.offset), 0.7e-3) == pytest.approx(wanted, rel=1e-12)
    assert friction_torque(in_ms._replace(offset=1e-3 * leg.offset), 0.7e-3) == pytest.approx(199.4 * wanted, rel=1e-3)


def test_friction_is_missing_in_3_11() -> None:
    """3.9 has f, 3.11 has lost it: with 1.32's values both motors are off by their friction."""
    at = beside()
    q_ddot, x_ddot = pinocchio_motion(at.state, np.array([0.6, -0.2]))
    forces = np.linalg.lstsq(at.a.T, MASS * x_ddot, rcond=None)[0]
    # along the kernel of A^T the multipliers are what the motors leave over
    inner = np.array([1.0, 1.0]) / math.sqrt(2.0)
    rest = np.array([0.6, -0.2]) - ZZ @ q_ddot - at.b @ forces
    forces = forces + inner * float(inner @ np.linalg.solve(at.b, rest))
    net = ZZ @ q_ddot + at.b @ forces
    np.testing.assert_allclose(net + FRICTION, np.array([0.6, -0.2]) + FRICTION, atol=1e-11)
    assert np.linalg.norm(net - (np.array([0.6, -0.2]) + FRICTION)) == pytest.approx(0.6085, abs=1e-3)


def test_away_states_are_what_the_other_tests_take_them_for() -> None:
    assert abs(det_a(away().state)) > 0.3
    assert abs(det_a(centre().state)) < 1e-15
    assert abs(det_a(beside().state)) < 1e-14
