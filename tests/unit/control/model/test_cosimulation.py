# SPDX-License-Identifier: Apache-2.0
"""Section 1.4.3 again: the inverse dynamics against an independent multi-body model, along one long motion.

The thesis moved both motors by sin(t) / 10 and found 1e-8 Nm between its model and ADAMS; here it is Pinocchio.
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from fivebar_control.model.dynamics import inverse_dynamics
from fivebar_control.model.geometry import direct_geometry, inverse_geometry
from fivebar_control.model.kinematics import det_a, platform_acceleration, state_from_platform
from fivebar_control.model.state import State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.parameters import FiveBar
from fivebar_studies.reproduce.cosimulation import distal_acceleration

Vectors = Callable[[State], tuple[NDArray[np.float64], NDArray[np.float64]]]


def test_torque_agrees_to_1e_10_nm_while_both_motors_swing_for_10_s(
    robot: FiveBar, loop: ClosedLoop, joint_vectors: Vectors
) -> None:
    home = state_from_platform(robot, (1, -1), 0.0, 0.13, 0.0, 0.0)
    assembly = 1 if det_a(home) > 0.0 else -1
    worst = largest = 0.0
    for sample in range(5001):
        t = sample / 500.0
        swing, rate, bend = math.sin(t) / 10.0, math.cos(t) / 10.0, -math.sin(t) / 10.0
        q11, q21 = home.leg1.q1 + swing, home.leg2.q1 + swing
        x, y = direct_geometry(robot, assembly, q11, q21)
        still = state_from_platform(robot, (1, -1), x, y, 0.0, 0.0)
        a = np.array([[still.leg1.u_x, still.leg1.u_y], [still.leg2.u_x, still.leg2.u_y]])
        vx, vy = np.linalg.solve(a, np.array([still.leg1.b, still.leg2.b]) * rate).tolist()
        state = state_from_platform(robot, (1, -1), x, y, vx, vy)
        assert abs(state.leg1.q1 - q11) < 1e-13
        assert abs(state.leg2.q1 - q21) < 1e-13

        ax, ay = platform_acceleration(state, bend, bend)
        bends = [
            distal_acceleration(parameters, leg, bend, ax, ay) - bend
            for parameters, leg in ((robot.leg1, state.leg1), (robot.leg2, state.leg2))
        ]
        q, v = joint_vectors(state)
        wanted = loop.inverse_dynamics(q, v, np.array([bend, bends[0], bend, bends[1]]))
        found = inverse_dynamics(robot, state, bend, bend, 0.0, 0.0)
        worst = max(worst, float(np.abs(np.subtract(found, wanted)).max()))
        largest = max(largest, float(np.abs(wanted).max()))
    assert worst <= 1e-10
    assert largest > 1e-3  # the motion does load the motors


def test_the_swing_starts_where_the_inverse_geometry_says(robot: FiveBar) -> None:
    """The motion above is in the assembly mode of its home, by both geometries."""
    home = inverse_geometry(robot, (1, -1), 0.0, 0.13)
    places = [direct_geometry(robot, assembly, home.q11, home.q21) for assembly in (1, -1)]
    assert min(math.dist(place, (0.0, 0.13)) for place in places) < 1e-14
