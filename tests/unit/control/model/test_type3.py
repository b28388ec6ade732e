# SPDX-License-Identifier: Apache-2.0
"""Type 3: no torque acts on the platform, and the motions that bounds.md names pass with finite torques, others not."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray

from fivebar_control.laws.unified import input_map
from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import state_from_joints, state_from_platform
from fivebar_control.model.state import State
from fivebar_control.workspace.loci import Type3, singular_loci
from fivebar_description.parameters import FiveBar, scaled
from fivebar_description.robot_file import load_robot
from fivebar_sim.effects.settings import PlantSettings
from fivebar_sim.plant import Plant

ROBOT = load_robot("dextar")
POINTS = singular_loci(ROBOT).type3
RATE_HZ, AROUND = 500, 0.03
"""Of the runs on the plant, and their time (s) before a point and after it."""

SPEED, BEND_RATE = 0.2, 6.0
"""Of the platform (m/s) and of the stretched leg's q_i2 (rad/s)."""


def torques(robot: FiveBar, point: Type3, dt: float, along: float) -> NDArray[np.float64]:
    """Return the torques (Nm) of the motion through a point, `dt` (s) later, with an acceleration (m/s^2) along t_s."""
    return np.array(moment(robot, point, dt, along)[1])


def moment(robot: FiveBar, point: Type3, dt: float, along: float) -> tuple[State, tuple[float, float]]:
    """Return the state of that motion, and its torques (Nm)."""
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
        state = state_from_platform(robot, (modes[0], modes[1]), *place.tolist(), *moving.tolist())
        turned = abs(math.remainder((state.leg1, state.leg2)[point.leg - 1].q1 - leg.q1, 2.0 * math.pi))
        # a stretched leg goes on to its other mode; a folded one keeps its elbow, which is the other mode too
        order = -sign * dt if point.shape == "stretched" else turned
        needed = inverse_dynamics_of_platform(robot, state, float(acceleration[0]), float(acceleration[1]), 0.0, 0.0)
        found.append((order, state, needed))
    _, state, needed = min(found, key=lambda one: one[0])
    return state, needed


def displaced(actual: FiveBar, point: Type3) -> tuple[float, list[float]]:
    """Return how far (m) the plant of a robot is from the motion when it has passed a point, and sin q_i2 of both legs.

    It takes the torques of the model, without feedback, from `AROUND` before the point to as long after it.
    """
    start, _ = moment(ROBOT, point, -AROUND, 0.0)
    legs = start.leg1, start.leg2
    joints = [angle for leg in legs for angle in (leg.q1, math.atan2(leg.sin_q2, leg.cos_q2))]
    rates = [rate for leg in legs for rate in (leg.dq1, leg.dtheta - leg.dq1)]
    plant = Plant(actual, joints, RATE_HZ, PlantSettings(friction_scale=0.0, torque_limit=2.0), velocities=rates)
    for number in range(round(2.0 * AROUND * RATE_HZ)):
        _, (tau1, tau2) = moment(ROBOT, point, -AROUND + (number + 0.5) / RATE_HZ, 0.0)
        plant.advance((tau1, tau2))
    end, _ = moment(ROBOT, point, AROUND, 0.0)
    angles = plant.joints.tolist()
    there = state_from_joints(actual, *angles, *plant.joint_velocities.tolist())
    return math.hypot(there.x - end.x, there.y - end.y), [math.sin(angles[1]), math.sin(angles[3])]


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


@pytest.mark.parametrize("point", POINTS, ids=lambda point: f"{point.shape}-{point.leg}-{point.x:.3f}-{point.y:.3f}")
def test_the_plant_goes_through_the_point_into_the_other_working_mode(point: Type3) -> None:
    start, _ = moment(ROBOT, point, -AROUND, 0.0)
    before = (start.leg1, start.leg2)[point.leg - 1].sin_q2
    error, after = displaced(ROBOT, point)
    assert error < 1e-7
    assert abs(before) > 0.05
    assert before * after[point.leg - 1] < 0.0
    # what the model does not know displaces it, by no more than an error of the torque does in this time
    assert 1e-6 < displaced(scaled(ROBOT, 1.1, 0.9, 1.0), point)[0] < 1e-4
