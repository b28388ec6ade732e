# SPDX-License-Identifier: Apache-2.0
"""The parameters as plain numbers: which masses they leave for bodies, and robots scaled against them."""

from __future__ import annotations

import pytest

from fivebar_description.parameters import scaled, tip_masses
from fivebar_description.robot_file import load_robot


def test_a_residual_inertia_takes_the_mass_that_it_needs_from_the_platform() -> None:
    robot = load_robot("dextar")
    assert tip_masses(robot) == (0.5 * robot.mass, 0.5 * robot.mass)
    least = load_robot("dextar")._replace(leg1=robot.leg1._replace(residual=-2.0e-3))
    one, two = tip_masses(least)
    assert one + two == pytest.approx(robot.mass, rel=1e-15)
    l_1, l_2 = robot.leg1.proximal, robot.leg1.distal
    tree = [robot.leg1.inertia + one * l_1**2, one * l_1 * l_2, one * l_2**2 - 2.0e-3]
    assert tree[0] * tree[2] > tree[1] ** 2
    assert one > two


def test_scaling_touches_mass_inertia_and_friction_and_nothing_else() -> None:
    robot = load_robot("dextar")
    other = scaled(robot, mass=1.1, inertia=0.9, friction=1.2)
    assert other.mass == pytest.approx(0.5907, rel=1e-15)
    assert other.leg1.inertia == pytest.approx(0.01197, rel=1e-15)
    assert other.leg2.inertia == pytest.approx(0.01278, rel=1e-15)
    assert other.leg1.coulomb == pytest.approx(0.414, rel=1e-15)
    assert other.leg1.offset == pytest.approx(0.1026, rel=1e-15)
    assert other.leg2.coulomb == pytest.approx(0.516, rel=1e-15)
    for before, after in ((robot.leg1, other.leg1), (robot.leg2, other.leg2)):
        assert after[:3] == before[:3]
        assert after.width == before.width
    assert scaled(robot) == robot
