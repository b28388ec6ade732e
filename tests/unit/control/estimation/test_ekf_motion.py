# SPDX-License-Identifier: Apache-2.0
"""The filter's process model against the controllers' model, and its derivatives against finite differences."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest

from fivebar_control.estimation.platform_motion import (
    Applied,
    acceleration_derivatives,
    leg_motion,
    platform_acceleration,
)
from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar, friction_torque

States = Callable[[int, int], list[State]]


def modes_of(state: State) -> tuple[int, int]:
    return (-1 if state.leg1.sin_q2 > 0.0 else 1), (-1 if state.leg2.sin_q2 > 0.0 else 1)


def torques(seed: int) -> tuple[float, float]:
    tau1, tau2 = np.random.default_rng(seed).uniform(-2.0, 2.0, 2).tolist()
    return tau1, tau2


@pytest.mark.parametrize("where", ["regular_states", "locus_states"])
def test_legs_and_acceleration_are_those_of_the_model(
    robot: FiveBar, where: str, request: pytest.FixtureRequest
) -> None:
    states: States = request.getfixturevalue(where)
    for number, state in enumerate(states(100, 1)):
        modes, tau = modes_of(state), torques(number)
        for leg, mode, expected in (
            (robot.leg1, modes[0], state.leg1),
            (robot.leg2, modes[1], state.leg2),
        ):
            moving = leg_motion(leg, mode, state.x, state.y, state.vx, state.vy)
            assert (moving.r_x, moving.r_y) == pytest.approx((expected.r_x, expected.r_y), abs=1e-12)
            assert (moving.u_x, moving.u_y) == pytest.approx((expected.u_x, expected.u_y), abs=1e-12)
            assert moving.dq1 == pytest.approx(expected.dq1, rel=1e-12, abs=1e-12)
            assert moving.dtheta == pytest.approx(expected.dtheta, rel=1e-12, abs=1e-12)
        f1, f2 = friction_torque(robot.leg1, state.leg1.dq1), friction_torque(robot.leg2, state.leg2.dq1)
        # the constraint form, which the process model is not made from
        expected_motion = direct_dynamics(robot, state, *tau, f1, f2)
        found = platform_acceleration(robot, modes, state.x, state.y, state.vx, state.vy, Applied(*tau, 0.0, 0.0))
        assert found == pytest.approx((expected_motion.ax, expected_motion.ay), rel=1e-12, abs=1e-12)


@pytest.mark.parametrize("residual", [0.0, -2.0e-4])
@pytest.mark.parametrize("where", ["regular_states", "locus_states"])
def test_derivatives_agree_with_central_differences(
    robot: FiveBar, where: str, residual: float, request: pytest.FixtureRequest
) -> None:
    states: States = request.getfixturevalue(where)
    robot = FiveBar(robot.leg1._replace(residual=residual), robot.leg2._replace(residual=-0.7 * residual), robot.mass)
    steps = (1e-7, 1e-7, 1e-6, 1e-6, 1e-4, 1e-4, 1e-4, 1e-4)
    for number, state in enumerate(states(100, 2)):
        modes = modes_of(state)
        point = np.array([state.x, state.y, state.vx, state.vy, *torques(number), 0.5, -1.5])
        found = acceleration_derivatives(robot, modes, *point.tolist()[:4], Applied(*point.tolist()[4:]))
        columns = []
        for index, step in enumerate(steps):
            shift = np.zeros(8)
            shift[index] = step
            one, other = (point + shift).tolist(), (point - shift).tolist()
            ahead = platform_acceleration(robot, modes, *one[:4], Applied(*one[4:]))
            behind = platform_acceleration(robot, modes, *other[:4], Applied(*other[4:]))
            columns.append((np.array(ahead) - np.array(behind)) / (2.0 * step))
        expected = np.array(columns).T
        analytic = np.array(
            [
                [found.p_xx, found.p_xy, found.v_xx, found.v_xy, found.t_x1, found.t_x2, found.f_xx, found.f_xy],
                [found.p_yx, found.p_yy, found.v_yx, found.v_yy, found.t_y1, found.t_y2, found.f_xy, found.f_yy],
            ]
        )
        for part in (slice(0, 2), slice(2, 4), slice(4, 6), slice(6, 8)):
            scale = np.abs(expected[:, part]).max() + 1.0
            np.testing.assert_allclose(analytic[:, part], expected[:, part], atol=3e-5 * scale)


def test_out_of_reach_and_at_type_1_it_is_not_a_number(dextar: FiveBar) -> None:
    reach, idle = dextar.leg1.proximal + dextar.leg1.distal, Applied(0.0, 0.0, 0.0, 0.0)
    for x in (dextar.leg1.base_x + reach, dextar.leg1.base_x + reach + 0.01, dextar.leg1.base_x):
        assert math.isnan(leg_motion(dextar.leg1, 1, x, 0.0, 0.1, 0.1).dq1)
        assert all(map(math.isnan, platform_acceleration(dextar, (1, -1), x, 0.0, 0.1, 0.1, idle)))
