"""Joint friction (1.32), with sign() smoothed so that it has a value at rest: of the model and of the plant alike.

What a motor loses besides, to cogging that is known and to the weight of its leg, is of the model alone.
"""

from __future__ import annotations

import math

from fivebar_description.parameters import FiveBar, LegParameters


def friction_torque(leg: LegParameters, dq1: float) -> float:
    """Return f = f_s tanh(dq1 / width) + f_off in Nm, for the motor speed dq1 in rad/s."""
    return leg.coulomb * math.tanh(dq1 / leg.width) + leg.offset


def weight_torque(robot: FiveBar, leg: LegParameters, r_x: float, r_y: float) -> float:
    """Return the torque (Nm) that holds the weight of a leg, its proximal link along the unit vector (r_x, r_y)."""
    return leg.moment * (robot.gravity_x * r_y - robot.gravity_y * r_x)


def lost_torque(robot: FiveBar, leg: LegParameters, q1: float, dq1: float) -> float:
    """Return friction, known cogging and the leg's weight in Nm, for a motor angle q1 in rad and speed dq1 in rad/s."""
    lost = friction_torque(leg, dq1)
    if leg.periods_1 > 0.0:
        lost += leg.cosine_1 * math.cos(leg.periods_1 * q1) + leg.sine_1 * math.sin(leg.periods_1 * q1)
    if leg.periods_2 > 0.0:
        lost += leg.cosine_2 * math.cos(leg.periods_2 * q1) + leg.sine_2 * math.sin(leg.periods_2 * q1)
    if leg.moment != 0.0:
        lost += weight_torque(robot, leg, math.cos(q1), math.sin(q1))
    return lost


def friction_slope(leg: LegParameters, dq1: float) -> float:
    """Return df / d(dq1) in Nm s/rad, for the motor speed dq1 in rad/s."""
    smooth = math.tanh(dq1 / leg.width)
    return leg.coulomb * (1.0 - smooth * smooth) / leg.width


def largest_friction(robot: FiveBar) -> float:
    """Return the most friction (Nm) that either motor of a robot has, at whatever speed."""
    return max(leg.coulomb + abs(leg.offset) for leg in (robot.leg1, robot.leg2))
