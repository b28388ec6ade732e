# SPDX-License-Identifier: Apache-2.0
"""The package by itself: the model moves as its inverse says, away from the singular locus."""

import pytest

from fivebar_control.model.dynamics import direct_dynamics, inverse_dynamics_of_platform
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_description.robot_file import load_robot


def test_the_dynamics_are_the_inverse_of_each_other() -> None:
    robot = load_robot("dextar")
    state = state_from_platform(robot, (1, -1), 0.02, 0.15, 0.3, -0.2)
    assert abs(det_a(state)) > 0.1
    torques = inverse_dynamics_of_platform(robot, state, 1.5, -2.5, 0.0, 0.0)
    response = direct_dynamics(robot, state, *torques, 0.0, 0.0)
    assert (response.ax, response.ay) == pytest.approx((1.5, -2.5), abs=1e-9)
