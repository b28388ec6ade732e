# SPDX-License-Identifier: Apache-2.0
"""The desired instant: what it says of friction, disturbances and rest."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from fivebar_control.laws.ctc import ctc_torque
from fivebar_control.laws.reference import (
    against_disturbance,
    reference_at_rest,
    reference_from_motors,
    reference_from_platform,
)
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import Platform, State
from fivebar_description.parameters import FiveBar, friction_torque

States = Callable[[int, int], list[State]]


def modes(state: State) -> tuple[int, int]:
    return (-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1)


def test_against_a_disturbance_the_law_gives_its_acceleration_all_the_same(
    robot: FiveBar, regular_states: States
) -> None:
    """What acts on the motors besides their torque is taken off it, motor by motor."""
    d1, d2 = 0.3, -0.2
    for state in regular_states(20, 95):
        desired = reference_from_platform(robot, modes(state), Platform(state.x, state.y, 0.1, 0.2, 1.0, -2.0))
        friction = desired.f1, desired.f2
        torque = ctc_torque(robot, state, desired, 2500.0, 100.0)
        wanted = direct_dynamics(robot, state, *torque, *friction)
        torque = ctc_torque(robot, state, against_disturbance(desired, d1, d2), 2500.0, 100.0)
        found = direct_dynamics(robot, state, torque.tau1 + d1, torque.tau2 + d2, *friction)
        assert (found.ax, found.ay) == pytest.approx((wanted.ax, wanted.ay), rel=1e-9, abs=1e-9)


def test_friction_is_that_of_the_desired_speeds(robot: FiveBar, regular_states: States) -> None:
    """Of either motor by its own parameters; at rest, whatever the state's speeds, only the offset is left."""
    for state in regular_states(20, 96):
        moving = state_from_platform(robot, modes(state), state.x, state.y, 0.2, -0.3)
        wanted = tuple(
            friction_torque(leg, at.dq1) for leg, at in ((robot.leg1, moving.leg1), (robot.leg2, moving.leg2))
        )
        platform = reference_from_platform(robot, modes(state), Platform(state.x, state.y, 0.2, -0.3, 1.0, 2.0))
        motors = reference_from_motors(robot, moving, 1.0, 2.0, 0.5, -0.5)
        assert (platform.f1, platform.f2) == (motors.f1, motors.f2) == wanted
        assert (platform.by_motors, platform.u1, platform.u2) == (False, 0.0, 0.0)
        rest = reference_at_rest(robot, moving)
        assert rest == (moving, 0.0, 0.0, robot.leg1.offset, robot.leg2.offset, False, 0.0, 0.0)


def test_a_motion_of_the_motors_takes_the_torque_that_moves_them_so(robot: FiveBar, regular_states: States) -> None:
    for state in regular_states(20, 97):
        reference = reference_from_motors(robot, state, 1.0, 2.0, 4.0, -3.0)
        assert (reference.ax, reference.ay, reference.by_motors) == (1.0, 2.0, True)
        motion = direct_dynamics(robot, state, reference.u1, reference.u2, 0.0, 0.0)
        assert (motion.ddq11, motion.ddq21) == pytest.approx((4.0, -3.0), rel=1e-7, abs=1e-7)
