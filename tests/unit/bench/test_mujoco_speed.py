# SPDX-License-Identifier: Apache-2.0
"""That the yardstick is the same mechanism: MuJoCo's free motion against the plant of the engine."""

from __future__ import annotations

import math

from fivebar_bringup.simulation.plant import PlantState, chain_at, stepped
from fivebar_control.model.kinematics import state_from_joints, state_from_platform
from fivebar_description.parameters import FiveBar, scaled
from fivebar_mujoco.mujoco_model import TINY_INERTIA, TINY_MASS
from mujoco_speed import STEP, MujocoFiveBar, loop_gap

STEPS = 600


def test_mujoco_moves_as_the_model_through_type_2_with_its_loop_nearly_closed(robot: FiveBar) -> None:
    start = state_from_platform(robot, (1, -1), 0.0, 0.13, 0.02, -0.3)
    mechanism = MujocoFiveBar(robot, start)
    tips = list(mechanism.tips(STEPS))
    free = scaled(robot, friction=0.0)
    one, two = start.leg1, start.leg2
    state = PlantState(
        chain_at(one.q1, one.q2, one.dq1, one.dtheta - one.dq1),
        chain_at(two.q1, two.q2, two.dq1, two.dtheta - two.dq1),
    )
    for place, _ in tips:
        state = stepped(free, state, STEP, 0.0, 0.0).state
        one_, two_ = state.leg1, state.leg2
        ours = state_from_joints(free, one_.q1, one_.q2, two_.q1, two_.q2, 0.0, 0.0, 0.0, 0.0)
        assert math.dist(place, (ours.x, ours.y)) < 1e-5
    assert ours.y < 0.06
    assert 0.0 < loop_gap(mechanism, STEPS) < 1e-7
    assert mechanism.seconds(10) > 0.0


def test_parts_that_the_model_lacks_weigh_next_to_nothing(dextar: FiveBar) -> None:
    least = min(dextar.leg1.inertia, dextar.leg2.inertia)
    assert 1e-9 * least > TINY_INERTIA
    assert TINY_MASS * dextar.leg1.proximal**2 < 1e-9 * least
