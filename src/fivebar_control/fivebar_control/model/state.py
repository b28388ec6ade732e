# SPDX-License-Identifier: Apache-2.0
"""The state of the five-bar, both legs and the platform, and the quantities that are measured or desired."""

from __future__ import annotations

from typing import NamedTuple

WorkingMode = tuple[int, int]
"""For each leg +1 where the elbow lies counter-clockwise of the line from the base to the platform, else -1."""


class Leg(NamedTuple):
    """Leg i with all quantities that the equations use; each sine and cosine is computed once.

    Attributes:
        q1: active angle q_i1 (rad).
        q2: passive relative angle q_i2 (rad).
        dq1: rate of q_i1 (rad/s).
        dtheta: rate of theta_i = q_i1 + q_i2 (rad/s).
        r_x, r_y: unit vector along the proximal link.
        u_x, u_y: unit vector along the distal link; row i of A.
        cos_q2, sin_q2: of the passive relative angle.
        b: l_i1 sin q_i2 (m), entry i of the diagonal matrix B.
        c: l_i2 dtheta^2 + l_i1 cos(q_i2) dq1^2 (m/s^2), entry i of c in A xddot + c = B qddot.
    """

    q1: float
    q2: float
    dq1: float
    dtheta: float
    r_x: float
    r_y: float
    u_x: float
    u_y: float
    cos_q2: float
    sin_q2: float
    b: float
    c: float


class State(NamedTuple):
    """Both legs and the platform at one instant; x, y in m, vx, vy in m/s, in the base frame."""

    leg1: Leg
    leg2: Leg
    x: float
    y: float
    vx: float
    vy: float


class JointAngles(NamedTuple):
    """The four joint angles (rad), in the order of :data:`fivebar_description.interface.JOINTS`."""

    q11: float
    q12: float
    q21: float
    q22: float


class Joints(NamedTuple):
    """Angles (rad) and rates (rad/s) of all joints, each in the order of `JointAngles`."""

    q11: float
    q12: float
    q21: float
    q22: float
    dq11: float
    dq12: float
    dq21: float
    dq22: float


class MotorMotion(NamedTuple):
    """Angles (rad), rates (rad/s) and accelerations (rad/s^2) of both motors."""

    q11: float
    q21: float
    dq11: float
    dq21: float
    ddq11: float
    ddq21: float


class Platform(NamedTuple):
    """Position (m), velocity (m/s) and acceleration (m/s^2) of the platform: a measurement or a reference."""

    x: float
    y: float
    vx: float
    vy: float
    ax: float
    ay: float
