# SPDX-License-Identifier: Apache-2.0
"""Slips in what is controllable on the locus: the columns (1, 1) of 1.3.1, 2.1, 3.24, 3.27 and 3.44; 2.8 to 2.11."""

from __future__ import annotations

import math
from itertools import pairwise, product

import numpy as np
import pytest
from scipy.optimize import brentq
from slip_cases import BASE, CENTRE_Y, LINK, MASS, MODE, ROBOT, Vector, away, centre, joints, pinocchio_motion

from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.geometry import inverse_geometry
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import WorkingMode


def test_the_distal_links_pull_against_each_other_at_the_centre() -> None:
    """m xddot = lambda_11 - lambda_21: the links are stretched, so the second column is (-1, 0)."""
    at = centre()
    np.testing.assert_allclose(at.a.T, [[1.0, -1.0], [0.0, 0.0]], atol=1e-15)
    torque = np.array([1.0, 0.4])
    motion = direct_dynamics(ROBOT, at.state, *torque.tolist(), 0.0, 0.0)
    force = MASS * pinocchio_motion(at.state, torque)[1][0]
    assert motion.lambda1 - motion.lambda2 == pytest.approx(force, abs=1e-10)
    assert motion.lambda1 + motion.lambda2 - force == pytest.approx(-9.414, abs=1e-3)


def test_the_columns_1_1_do_not_occur_on_the_vertical_axis() -> None:
    """The x components of u_1 and u_2 add up to 0 wherever x = 0 meets the locus, and not to 2.

    Stretched links have u_2 = -u_1. Folded links of equal length need both elbows in one point, which is on x = 0 too,
    so that u_1 = u_2 = (0, +-1).
    """

    def distal(mode: WorkingMode, y: float) -> tuple[float, Vector]:
        state = state_from_platform(ROBOT, mode, 0.0, y, 0.0, 0.0)
        return det_a(state), np.array([[state.leg1.u_x, state.leg1.u_y], [state.leg2.u_x, state.leg2.u_y]])

    folds = set()
    top = math.sqrt((2.0 * LINK) ** 2 - BASE**2 / 4.0)
    for mode in product((1, -1), repeat=2):
        for low, high in pairwise(np.linspace(-0.999 * top, 0.999 * top, 300).tolist()):
            if distal(mode, low)[0] * distal(mode, high)[0] >= 0.0:
                continue
            y = float(brentq(lambda y, mode=mode: distal(mode, y)[0], low, high, xtol=1e-17))
            links = distal(mode, y)[1]
            assert abs(links[0, 0] + links[1, 0]) < 1e-12
            folds.add(round(float(links[0] @ links[1])))
    assert folds == {-1, 1}


def test_a_s_of_3_27_with_two_plus_signs_does_not_command_the_platform() -> None:
    """3.44 takes cos 0 twice where the second angle is pi. Asked for 3 m/s^2, the platform gets 0.03 m/s^2."""
    at = centre()
    zz = np.diag([0.0133, 0.0142])
    wanted = 3.0
    found = {}
    for signs in ((1.0, 1.0), (1.0, -1.0)):
        row = np.linalg.solve(at.b, np.array(signs))
        q_ddot = row * wanted + at.drift
        tau = row * (row @ zz @ q_ddot + MASS * wanted) / (row @ row)
        found[signs] = float(pinocchio_motion(at.state, tau)[1][0])
    assert found[1.0, -1.0] == pytest.approx(wanted, abs=1e-10)
    assert found[1.0, 1.0] == pytest.approx(0.0287, abs=1e-4)
    assert math.cos(at.state.leg2.q1 + at.state.leg2.q2) == pytest.approx(-1.0, abs=1e-15)


def test_phi_of_2_10_needs_a_working_mode() -> None:
    """2.8 has two solutions for the same y, 1.55 rad apart: the mode has to be said."""
    y = CENTRE_Y + 0.03
    angles = [inverse_geometry(ROBOT, (mode, -1), 0.0, y).q11 for mode in (1, -1)]
    for angle in angles:
        residual = (BASE / 2.0 - LINK * math.cos(angle)) ** 2 + (y - LINK * math.sin(angle)) ** 2 - LINK**2
        assert abs(residual) < 1e-16
    assert angles[0] - angles[1] == pytest.approx(1.55, abs=0.01)


def test_2_6_to_2_9_are_right() -> None:
    """The bases are at -+a/2, so x = 0 leaves + a/2 in 2.8 and - a/2 in 2.9, as printed."""
    q = joints(away().state)[0]
    for active, base, x, y in ((q[0], BASE / 2.0, 0.03, 0.12), (q[2], -BASE / 2.0, 0.03, 0.12)):
        reach = (x + base - LINK * math.cos(active)) ** 2 + (y - LINK * math.sin(active)) ** 2
        assert reach == pytest.approx(LINK**2, abs=1e-15)
    angles = inverse_geometry(ROBOT, MODE, 0.0, 0.12)
    reach = (-BASE / 2.0 - LINK * math.cos(angles.q21)) ** 2 + (0.12 - LINK * math.sin(angles.q21)) ** 2
    assert reach == pytest.approx(LINK**2, abs=1e-15)
