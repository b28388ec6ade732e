# SPDX-License-Identifier: Apache-2.0
"""Slips in the constraint with Cartesian variables: 3.31 to 3.35, and its extension at the end of 3.3."""

from __future__ import annotations

import numpy as np
import pytest
from slip_cases import FRICTION, MASS, MODE, ROBOT, ZZ, Case, beside, centre, pinocchio_motion

from fivebar_control.laws.gains import RESOLUTIONS
from fivebar_control.laws.reference import reference_from_platform
from fivebar_control.laws.vhc_cartesian import vhc_cartesian_torque
from fivebar_control.model.line import Line
from fivebar_control.model.state import Platform


def acceleration_along_v1(at: Case, wanted: float, motors: float, drift: float) -> float:
    """What 3.35 gives along v1 = u_1 when asked for `wanted`, with signs for the motors' inertia and for the drift."""
    row = np.linalg.solve(at.b, at.a @ at.a[0])
    inertia = row @ ZZ @ row
    tau = row / (row @ row) * ((MASS + motors * inertia) * wanted + drift * row @ ZZ @ at.drift + row @ FRICTION)
    return float(at.a[0] @ pinocchio_motion(at.state, tau - FRICTION)[1])


def test_the_effective_inertia_of_3_35_is_a_sum() -> None:
    """The printed minus gives -0.755 of what is asked for: the constraint is driven away from, not towards.

    J = 3.852 kg is what the motors add; (m - J)/(m + J) < 0 wherever J exceeds m.
    """
    assert acceleration_along_v1(centre(), 3.0, 1.0, 1.0) == pytest.approx(3.0, abs=1e-9)
    assert acceleration_along_v1(centre(), 3.0, -1.0, 1.0) == pytest.approx(-0.7553 * 3.0, abs=1e-3)
    assert acceleration_along_v1(beside(), 3.0, -1.0, 1.0) == pytest.approx(-0.9 * 3.0, abs=1e-3)


def test_the_drift_in_3_31_to_3_35_has_a_plus() -> None:
    """In the posture of 3.45 at 0.3 m/s the printed minus takes 1.24 m/s^2 off what is asked for."""
    assert acceleration_along_v1(beside(), 3.0, 1.0, 1.0) == pytest.approx(3.0, abs=1e-9)
    assert acceleration_along_v1(beside(), 3.0, 1.0, -1.0) - 3.0 == pytest.approx(-1.2423, abs=1e-3)


def test_3_31_does_not_follow_from_3_30_even_by_its_own_signs() -> None:
    """3.30: qddot = -B^-1 A_s^T xddot + b; 3.31 puts -(B^-1 A_s^T xddot + b) in its place."""
    at = beside()
    a_s, serial, serial_dot = at.a @ at.a[0], -at.b, -at.b_dot  # A xdot + B qdot = 0 holds for -B
    b = -np.linalg.solve(serial, at.a_dot @ at.x_dot + serial_dot @ at.q_dot)
    x_ddot = 3.0
    q_ddot = -np.linalg.solve(serial, a_s) * x_ddot + b
    np.testing.assert_allclose(q_ddot, np.linalg.solve(at.b, a_s) * x_ddot + at.drift, atol=1e-10)
    row = np.linalg.solve(serial.T, a_s)
    left = row @ ZZ @ q_ddot
    assert -row @ ZZ @ (np.linalg.solve(serial, a_s) * x_ddot - b) == pytest.approx(left, abs=1e-9)
    assert abs(-row @ ZZ @ (np.linalg.solve(serial, a_s) * x_ddot + b) - left) == pytest.approx(13.34, abs=0.01)


def test_mended_3_35_is_the_law_of_this_project() -> None:
    """With all signs mended and x = 0 as its constraint it is `min_norm`, to rounding."""
    at = centre()
    reference = reference_from_platform(ROBOT, MODE, Platform(0.0, at.state.y, 0.0, -0.3, 0.0, 0.0))
    f = np.array([reference.f1, reference.f2])
    row = np.linalg.solve(at.b, np.array([1.0, -1.0]))
    v_2 = -2500.0 * 1e-3
    mended = row / (row @ row) * ((MASS + row @ ZZ @ row) * v_2 + row @ ZZ @ at.drift + row @ f)
    line = Line(-1e-3, 0.15, 0.0, -1.0)
    law = vhc_cartesian_torque(ROBOT, at.state, reference, line, 2500.0, 100.0, RESOLUTIONS["min_norm"])
    np.testing.assert_allclose(law, mended, atol=1e-10)


def test_a_constraint_that_is_not_square_to_v1_needs_its_share() -> None:
    """End of 3.3: along x the platform gets n . v1 = 0.906 of v_2, unless alpha = v_2 / (n . v1)."""
    at = beside()
    n = np.array([1.0, 0.0])
    row = np.linalg.solve(at.b, at.a @ at.a[0])
    found = []
    for alpha in (3.0, 3.0 / (n @ at.a[0])):
        tau = row / (row @ row) * ((MASS + row @ ZZ @ row) * alpha + row @ ZZ @ at.drift)
        found.append(float(n @ pinocchio_motion(at.state, tau)[1]))
    assert found == pytest.approx([0.9059 * 3.0, 3.0], abs=1e-3)
    assert found[1] == pytest.approx(3.0, abs=1e-9)
