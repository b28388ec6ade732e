# SPDX-License-Identifier: Apache-2.0
"""The regressor against Pinocchio's closed loop, which shares no equation with it."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fivebar_control.identification.identification import parameter_values
from fivebar_control.identification.regressor import NOWHERE, platform_load
from fivebar_control.model.kinematics import det_a
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import MotorMotion, State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar

Vector = NDArray[np.float64]


def closed_acceleration(loop: ClosedLoop, q: Vector, v: Vector, motors: Vector) -> Vector:
    """The four accelerations that keep the loop closed, from the Jacobian of its gap and a difference of it."""
    step = 1e-6
    jacobian = loop.tip_gap(q).jacobian
    drift = (loop.tip_gap(q + step * v).jacobian - loop.tip_gap(q - step * v).jacobian) @ v / (2.0 * step)
    passive = np.linalg.solve(jacobian[:, [1, 3]], -drift - jacobian[:, [0, 2]] @ motors)
    return np.array([motors[0], passive[0], motors[1], passive[1]])


def test_it_gives_the_torques_of_pinocchio(
    robot: FiveBar,
    loop: ClosedLoop,
    regular_states: Callable[[int, int], list[State]],
    joint_vectors: Callable[[State], tuple[Vector, Vector]],
) -> None:
    """In all working and assembly modes, from the motors' motion alone."""
    random = np.random.default_rng(11)
    zz_1, zz_2, mass = parameter_values(robot)[:3]
    modes = set()
    for state in regular_states(200, 7):
        motors = random.uniform(-80.0, 80.0, 2)
        q, v = joint_vectors(state)
        expected = loop.inverse_dynamics(q, v, closed_acceleration(loop, q, v, motors))
        assembly = 1 if det_a(state) > 0.0 else -1
        motion = MotorMotion(state.leg1.q1, state.leg2.q1, state.leg1.dq1, state.leg2.dq1, *motors.tolist())
        load = platform_load(robot, assembly, motion)
        found = np.array([zz_1 * motors[0] + mass * load.load1, zz_2 * motors[1] + mass * load.load2])
        assert np.allclose(found, expected, atol=1e-6 * np.max(np.abs(expected)), rtol=0.0)
        assert math.isclose(load.kappa, inverse_condition(state), rel_tol=1e-6)
        modes.add(assembly)
    assert modes == {1, -1}


def test_open_loops_have_no_load(robot: FiveBar) -> None:
    """Elbows turned away from each other are too far apart for the distal links."""
    motion = MotorMotion(math.pi, 0.0, 0.1, 0.1, 1.0, 1.0)
    assert platform_load(robot, 1, motion) == NOWHERE


def test_masses_and_friction_of_the_robot_have_no_say(robot: FiveBar) -> None:
    heavy = robot._replace(mass=7.0, leg1=robot.leg1._replace(inertia=3.0, coulomb=2.0, offset=1.0))
    motion = MotorMotion(1.9, 1.2, 0.5, -0.4, 10.0, 20.0)
    load = platform_load(robot, 1, motion)
    assert load == platform_load(heavy, 1, motion)
    assert load != NOWHERE
