# SPDX-License-Identifier: Apache-2.0
"""Inverse and direct geometry (2.6, 2.7, 3.37, 3.38) in all working and assembly modes.

A working mode is a pair of signs, one per leg: +1 where the elbow lies counter-clockwise of the line from the base to
the platform. It fixes the sign of sin q_i2, so (x, working mode) gives the joint angles uniquely, also on the Type 2
locus. The assembly mode is the sign of det A; joint angles give the platform only together with it.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.state import JointAngles, WorkingMode
from fivebar_description.parameters import FiveBar, LegParameters

NAN = math.nan


def leg_cosine(leg: LegParameters, x: float, y: float) -> float:
    """Return cos q_i2 that places the platform at (x, y); outside [-1, 1] where leg i cannot reach."""
    dx = x - leg.base_x
    numerator = dx * dx + y * y - leg.proximal * leg.proximal - leg.distal * leg.distal
    return numerator / (2.0 * leg.proximal * leg.distal)


def leg_angles(leg: LegParameters, mode: int, x: float, y: float) -> tuple[float, float]:
    """Return (q_i1, q_i2) in rad for the platform at (x, y), q_i1 in (-pi, pi]; NaN where it is out of reach."""
    cos_q2 = leg_cosine(leg, x, y)
    if not -1.0 <= cos_q2 <= 1.0:
        return NAN, NAN
    sin_q2 = -mode * math.sqrt((1.0 - cos_q2) * (1.0 + cos_q2))
    toward_platform = math.atan2(y, x - leg.base_x)
    elbow = math.atan2(leg.distal * sin_q2, leg.proximal + leg.distal * cos_q2)
    return wrap(toward_platform - elbow), math.atan2(sin_q2, cos_q2)


def inverse_geometry(robot: FiveBar, mode: WorkingMode, x: float, y: float) -> JointAngles:
    """Return the joint angles (rad) for the platform at (x, y) m in a working mode; NaN where out of reach."""
    q11, q12 = leg_angles(robot.leg1, mode[0], x, y)
    q21, q22 = leg_angles(robot.leg2, mode[1], x, y)
    return JointAngles(q11, q12, q21, q22)


def direct_geometry(robot: FiveBar, assembly: int, q11: float, q21: float) -> tuple[float, float]:
    """Return the platform (x, y) m for motor angles in an assembly mode, the sign of det A.

    NaN where the distal links cannot meet. The platform is one of the two points where the circles of the distal
    links around the elbows intersect. On the Type 2 locus both are one point, or any point of one circle where the
    elbows of equal distal links are in one place.
    """
    e1_x, e1_y = elbow_position(robot.leg1, q11)
    e2_x, e2_y = elbow_position(robot.leg2, q21)
    dx, dy = e2_x - e1_x, e2_y - e1_y
    distance = math.sqrt(dx * dx + dy * dy)
    if distance == 0.0:
        return NAN, NAN
    l_12, l_22 = robot.leg1.distal, robot.leg2.distal
    along = (distance * distance + l_12 * l_12 - l_22 * l_22) / (2.0 * distance)
    across_squared = (l_12 - along) * (l_12 + along)
    if across_squared < 0.0:
        return NAN, NAN
    # u1 x u2 has the sign of the side of the line E1-E2 on which the platform lies
    across = assembly * math.sqrt(across_squared)
    return e1_x + (along * dx - across * dy) / distance, e1_y + (along * dy + across * dx) / distance


def elbow_position(leg: LegParameters, q1: float) -> tuple[float, float]:
    """Return the position (m) of the joint between both links of leg i for its motor angle (rad)."""
    return leg.base_x + leg.proximal * math.cos(q1), leg.proximal * math.sin(q1)


class Bounds(NamedTuple):
    """A rectangle in the plane, its sides along x and y (m)."""

    left: float
    right: float
    bottom: float
    top: float


def workspace_bounds(robot: FiveBar) -> Bounds:
    """Return a rectangle that holds every point that both legs reach: the common part of their outer circles' boxes."""
    leg1, leg2 = robot.leg1, robot.leg2
    reach1, reach2 = leg1.proximal + leg1.distal, leg2.proximal + leg2.distal
    top = min(reach1, reach2)
    return Bounds(
        max(leg1.base_x - reach1, leg2.base_x - reach2), min(leg1.base_x + reach1, leg2.base_x + reach2), -top, top
    )


def workspace_margin(robot: FiveBar, x: float, y: float) -> float:
    """Return how far (m) the platform is inside the reach of both legs; negative outside, 0 at Type 1."""
    return min(reach_margin(robot.leg1, x, y), reach_margin(robot.leg2, x, y))


def reach_margin(leg: LegParameters, x: float, y: float) -> float:
    """Return how far (m) the platform is inside the ring that leg i reaches; negative outside, 0 at Type 1."""
    dx = x - leg.base_x
    distance = math.sqrt(dx * dx + y * y)
    outer = leg.proximal + leg.distal - distance
    inner = distance - abs(leg.proximal - leg.distal)
    return min(outer, inner)


def wrap(angle: float) -> float:
    """Return the angle in (-pi, pi]; NaN for an angle that is not finite."""
    if -math.pi < angle <= math.pi:
        return angle
    turned = math.copysign(abs(angle) % (2.0 * math.pi), angle)
    if turned > math.pi:
        return turned - 2.0 * math.pi
    if turned <= -math.pi:
        return turned + 2.0 * math.pi
    return turned
