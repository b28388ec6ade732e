"""Type 3: no torque acts on the platform, and the motions that theory.md names pass with finite torques, others not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.laws.unified import input_map
from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import state_from_joints, state_from_platform
from fivebar_control.workspace.loci import Type3, singular_loci
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import load_robot

ROBOT = load_robot("dextar")
POINTS = singular_loci(ROBOT).type3
SPEED, BEND_RATE = 0.2, 6.0
"""Of the platform (m/s) and of the stretched leg's q_i2 (rad/s)."""


def torques(robot: FiveBar, point: Type3, dt: float, along: float) -> NDArray[np.float64]:
    """Return the torques (Nm) of the motion through a point, `dt` (s) later, with an acceleration (m/s^2) along t_s."""
    there = state_from_joints(robot, *point.joints, 0.0, 0.0, 0.0, 0.0)
    leg, links = ((there.leg1, robot.leg1), (there.leg2, robot.leg2))[point.leg - 1]
    u = np.array((leg.u_x, leg.u_y))
    t_s = np.array((-u[1], u[0]))
    acceleration = along * t_s
    if point.shape == "stretched":
        reach = links.proximal + links.distal
        acceleration = acceleration - u * (SPEED**2 + links.proximal * links.distal * BEND_RATE**2) / reach
    velocity = SPEED * t_s
    place = np.array((point.x, point.y)) + velocity * dt + 0.5 * acceleration * dt * dt
    moving = velocity + acceleration * dt
    found = []
    for sign in (1, -1):
        modes = list(point.working_modes[0])
        modes[point.leg - 1] = sign
        state = state_from_platform(robot, modes[0], modes[1], *place.tolist(), *moving.tolist())
        turned = abs(math.remainder((state.leg1, state.leg2)[point.leg - 1].q1 - leg.q1, 2.0 * math.pi))
        # a stretched leg goes on to its other mode; a folded one keeps its elbow, which is the other mode too
        order = -sign * dt if point.shape == "stretched" else turned
        found.append((order, inverse_dynamics_of_platform(robot, state, *acceleration.tolist(), 0.0, 0.0)))
    return np.array(min(found)[1])


@pytest.mark.parametrize("point", POINTS, ids=lambda point: f"{point.shape}-{point.leg}-{point.x:.3f}-{point.y:.3f}")
def test_a_motion_that_the_state_allows_passes_with_a_finite_torque(point: Type3) -> None:
    state = state_from_joints(ROBOT, *point.joints, 0.0, 0.0, 0.0, 0.0)
    mapped = input_map(ROBOT, state)
    assert mapped is not None
    assert np.max(np.abs(mapped[:4])) < 1e-12
    passing = np.array([torques(ROBOT, point, dt, 0.0) for dt in (-1e-3, -1e-4, 1e-4, 1e-3)])
    assert np.max(np.abs(passing)) < 0.27
    assert np.max(np.ptp(passing, axis=0)) < 2e-3
    near, nearer = (np.max(np.abs(torques(ROBOT, point, dt, 1.0))) for dt in (1e-3, 1e-4))
    assert near > 10.0
    assert nearer == pytest.approx(10.0 * near, rel=0.05)
