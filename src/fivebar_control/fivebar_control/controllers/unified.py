"""One law on the locus and away from it: the torque that comes nearest to the wanted acceleration within its limits.

In platform coordinates the robot is regular through Type 2 and only its input matrix loses rank: xddot = G u + a_0 with
u = tau - f. Instead of inverting G, this law minimises |G u + a_0 - a|^2 + w |u|^2 over the torques that the drives can
give, a = xddot_d + Kd e' + Kp e. Away from the locus w hardly matters and the law is a computed torque law in Cartesian
space; on the locus it lets go of the direction t_s, in which nothing can be asked, and keeps the other.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.controllers.reference import Reference
from fivebar_control.controllers.torque import UNDEFINED, Torque
from fivebar_control.model.state import State
from fivebar_description.parameters import FiveBar


class InputMap(NamedTuple):
    """Platform acceleration as a function of the torques beyond friction: xddot = G u + a_0.

    G in m/s^2 per Nm, a_0 in m/s^2.
    """

    g_x1: float
    g_x2: float
    g_y1: float
    g_y2: float
    a0_x: float
    a0_y: float


def input_map(robot: FiveBar, state: State) -> InputMap | None:
    """Return the map from the constraint form, regular at Types 1 and 2; None where both meet in both legs.

    With K = A A^T / m + B ZZ^-1 B: G = A^T K^-1 B ZZ^-1 / m and a_0 = -A^T K^-1 c / m.
    """
    leg1, leg2 = state.leg1, state.leg2
    drive1, drive2 = leg1.b / robot.leg1.inertia, leg2.b / robot.leg2.inertia
    k11 = 1.0 / robot.mass + leg1.b * drive1
    k22 = 1.0 / robot.mass + leg2.b * drive2
    k12 = (leg1.u_x * leg2.u_x + leg1.u_y * leg2.u_y) / robot.mass
    determinant = k11 * k22 - k12 * k12
    if determinant <= 0.0:
        return None
    scale = 1.0 / (robot.mass * determinant)
    # columns of A^T K^-1 / m
    e1_x, e1_y = scale * (k22 * leg1.u_x - k12 * leg2.u_x), scale * (k22 * leg1.u_y - k12 * leg2.u_y)
    e2_x, e2_y = scale * (k11 * leg2.u_x - k12 * leg1.u_x), scale * (k11 * leg2.u_y - k12 * leg1.u_y)
    return InputMap(
        g_x1=e1_x * drive1,
        g_x2=e2_x * drive2,
        g_y1=e1_y * drive1,
        g_y2=e2_y * drive2,
        a0_x=-(e1_x * leg1.c + e2_x * leg2.c),
        a0_y=-(e1_y * leg1.c + e2_y * leg2.c),
    )


class Box(NamedTuple):
    """Limits of two unknowns."""

    low1: float
    high1: float
    low2: float
    high2: float


def box_least_squares(
    h11: float, h12: float, h22: float, right1: float, right2: float, box: Box
) -> tuple[float, float]:
    """Return the minimum of u^T H u / 2 - r^T u within a box, H symmetric and positive definite.

    Exact and in constant time: the free minimum if the box holds it, else the best of the four edges, on each of which
    the problem has one unknown.
    """
    determinant = h11 * h22 - h12 * h12
    u1, u2 = (h22 * right1 - h12 * right2) / determinant, (h11 * right2 - h12 * right1) / determinant
    if box.low1 <= u1 <= box.high1 and box.low2 <= u2 <= box.high2:
        return u1, u2
    best, best_u1, best_u2 = float("inf"), box.low1, box.low2
    for edge in range(4):
        if edge < 2:
            u1 = box.low1 if edge == 0 else box.high1
            u2 = min(max((right2 - h12 * u1) / h22, box.low2), box.high2)
        else:
            u2 = box.low2 if edge == 2 else box.high2
            u1 = min(max((right1 - h12 * u2) / h11, box.low1), box.high1)
        cost = 0.5 * (h11 * u1 * u1 + 2.0 * h12 * u1 * u2 + h22 * u2 * u2) - right1 * u1 - right2 * u2
        if cost < best:
            best, best_u1, best_u2 = cost, u1, u2
    return best_u1, best_u2


class UnifiedSettings(NamedTuple):
    """Gains (1/s^2, 1/s), price of torque beyond friction ((m/s^2 / Nm)^2) and torque limit (Nm, inf for none)."""

    kp: float = 6400.0
    kd: float = 160.0
    weight: float = 3.0
    torque_limit: float = math.inf


def unified_torque(
    robot: FiveBar, state: State, reference: Reference, kp: float, kd: float, weight: float, torque_limit: float
) -> Torque:
    """Return the torque (Nm) of the unified law; kp in 1/s^2, kd in 1/s.

    Args:
        robot: the robot that the law believes in.
        state: measured state.
        reference: desired instant; friction is compensated at its speeds.
        kp: proportional gain on the platform's position error.
        kd: derivative gain on the platform's velocity error.
        weight: price of torque beyond friction, (m/s^2 / Nm)^2, positive.
        torque_limit: largest torque of either motor (Nm).
    """
    mapped = input_map(robot, state)
    if mapped is None:
        return UNDEFINED
    desired = reference.state
    wanted_x = reference.ax + kd * (desired.vx - state.vx) + kp * (desired.x - state.x) - mapped.a0_x
    wanted_y = reference.ay + kd * (desired.vy - state.vy) + kp * (desired.y - state.y) - mapped.a0_y
    u1, u2 = box_least_squares(
        mapped.g_x1 * mapped.g_x1 + mapped.g_y1 * mapped.g_y1 + weight,
        mapped.g_x1 * mapped.g_x2 + mapped.g_y1 * mapped.g_y2,
        mapped.g_x2 * mapped.g_x2 + mapped.g_y2 * mapped.g_y2 + weight,
        mapped.g_x1 * wanted_x + mapped.g_y1 * wanted_y,
        mapped.g_x2 * wanted_x + mapped.g_y2 * wanted_y,
        Box(
            -torque_limit - reference.f1,
            torque_limit - reference.f1,
            -torque_limit - reference.f2,
            torque_limit - reference.f2,
        ),
    )
    return Torque(u1 + reference.f1, u2 + reference.f2)
