# SPDX-License-Identifier: Apache-2.0
"""Friction (1.32), smoothed."""

from __future__ import annotations

import math

import pytest

from fivebar_description.parameters import FiveBar, friction_slope, friction_torque


def test_at_speed_it_is_equation_1_32(dextar: FiveBar) -> None:
    for speed, sign in ((0.5, 1.0), (-0.5, -1.0), (20.0, 1.0)):
        assert friction_torque(dextar.leg1, speed) == pytest.approx(0.345 * sign + 0.0855, abs=1e-15)
        assert friction_torque(dextar.leg2, speed) == pytest.approx(0.430 * sign, abs=1e-15)


def test_at_rest_only_the_offset_is_left(dextar: FiveBar) -> None:
    assert friction_torque(dextar.leg1, 0.0) == 0.0855
    assert friction_torque(dextar.leg2, 0.0) == 0.0


def test_the_width_is_where_76_percent_are_reached(dextar: FiveBar) -> None:
    assert friction_torque(dextar.leg2, 0.02) == pytest.approx(0.430 * 0.7615941559557649, rel=1e-15)
    assert friction_torque(dextar.leg2, -0.02) == pytest.approx(-0.430 * 0.7615941559557649, rel=1e-15)


def test_the_slope_at_rest_is_the_coulomb_friction_over_the_width(robot: FiveBar) -> None:
    for leg in (robot.leg1, robot.leg2):
        slope = (friction_torque(leg, 1e-6) - friction_torque(leg, -1e-6)) / 2e-6
        assert slope == pytest.approx(leg.coulomb / leg.width, rel=1e-8)


def test_the_slope_is_the_derivative_of_the_torque(robot: FiveBar) -> None:
    for leg in (robot.leg1, robot.leg2):
        for speed in (0.0, 0.5 * leg.width, -2.0 * leg.width, 0.3):
            ahead, behind = speed + 1e-5 * leg.width, speed - 1e-5 * leg.width
            difference = (friction_torque(leg, ahead) - friction_torque(leg, behind)) / (ahead - behind)
            assert friction_slope(leg, speed) == pytest.approx(difference, rel=1e-6, abs=1e-9 * leg.coulomb / leg.width)


def test_an_undefined_speed_gives_undefined_friction(dextar: FiveBar) -> None:
    assert math.isnan(friction_torque(dextar.leg1, math.nan))
