# SPDX-License-Identifier: Apache-2.0
"""What the tests of the slips share: DexTAR at chosen places, the matrices of the equations, and Pinocchio's answer."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import State
from fivebar_description.closed_loop import ClosedLoop
from fivebar_description.robot_file import load_robot

Vector = NDArray[np.float64]

ROBOT = load_robot("dextar")
LOOP = ClosedLoop(ROBOT)
LINK = 0.09
BASE = 0.118
MASS = 0.537
ZZ = np.diag([0.0133, 0.0142])
MODE = (1, -1)

CENTRE_Y = math.sqrt(LINK**2 - (LINK - BASE / 2.0) ** 2)
"""Where the vertical path x = 0 meets the locus, elbows outwards (m)."""

FRICTION = np.array([0.345 + 0.0855, -0.430])
"""1.32 with motor 1 turning forwards and motor 2 backwards (Nm)."""


class Case(NamedTuple):
    """A state with A (rows u_i), B = diag(l sin q_i2) and their derivatives by time, all from the angles."""

    state: State
    a: Vector
    b: Vector
    a_dot: Vector
    b_dot: Vector
    x_dot: Vector
    q_dot: Vector

    @property
    def drift(self) -> Vector:
        """Motor accelerations (rad/s^2) for a platform without acceleration: B^-1 (Adot xdot - Bdot qdot)."""
        return np.linalg.solve(self.b, self.a_dot @ self.x_dot - self.b_dot @ self.q_dot)


def case(x: float, y: float, vx: float, vy: float) -> Case:
    """DexTAR with the platform at (x, y) m, moving at (vx, vy) m/s, elbows outwards."""
    state = state_from_platform(ROBOT, MODE, x, y, vx, vy)
    legs = (state.leg1, state.leg2)
    thetas = [leg.q1 + leg.q2 for leg in legs]
    return Case(
        state,
        np.array([[math.cos(theta), math.sin(theta)] for theta in thetas]),
        np.diag([LINK * math.sin(leg.q2) for leg in legs]),
        np.array(
            [
                [-leg.dtheta * math.sin(theta), leg.dtheta * math.cos(theta)]
                for leg, theta in zip(legs, thetas, strict=True)
            ]
        ),
        np.diag([LINK * math.cos(leg.q2) * (leg.dtheta - leg.dq1) for leg in legs]),
        np.array([vx, vy]),
        np.array([leg.dq1 for leg in legs]),
    )


def away() -> Case:
    """A moving robot away from every singularity."""
    return case(0.03, 0.12, 0.2, -0.4)


def centre() -> Case:
    """Where the vertical path crosses the locus, downwards at 0.3 m/s; the distal links are level and stretched."""
    return case(0.0, CENTRE_Y, 0.0, -0.3)


def beside() -> Case:
    """The posture of 3.45, put exactly onto the locus, crossing it at 0.3 m/s along t_s."""
    x = -0.06745
    y = float(brentq(lambda y: det_a(state_from_platform(ROBOT, MODE, x, y, 0.0, 0.0)), 0.035, 0.045, xtol=1e-17))
    u_x, u_y = case(x, y, 0.0, 0.0).a[0].tolist()
    return case(x, y, 0.3 * u_y, -0.3 * u_x)


def joints(state: State) -> tuple[Vector, Vector]:
    """Angles and rates (q11, q12, q21, q22)."""
    leg1, leg2 = state.leg1, state.leg2
    return (
        np.array([leg1.q1, leg1.q2, leg2.q1, leg2.q2]),
        np.array([leg1.dq1, leg1.dtheta - leg1.dq1, leg2.dq1, leg2.dtheta - leg2.dq1]),
    )


def pinocchio_motion(state: State, net: Vector) -> tuple[Vector, Vector]:
    """Motor and platform accelerations under motor torques less friction (Nm), without any equation of the thesis."""
    q, v = joints(state)
    a = LOOP.acceleration(q, v, np.array([net[0], 0.0, net[1], 0.0]))
    return a[[0, 2]], LOOP.platform(q, v, a)[2]
