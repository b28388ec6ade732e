"""The inverse dynamics as a product of known motion and unknown parameters.

tau = ZZ qddot + B lambda + f with A^T lambda = m xddot (1.30, 1.31) and the friction of 1.32 is linear in zz_11R,
zz_21R, m, f_s and f_off of both motors. The motors' angles and their derivatives are all that it takes: the direct
geometry gives the platform in a known assembly mode, and J = A^-1 B its motion. No passive joint is read, and a leg may
pass through Type 1.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.dynamics import multipliers
from fivebar_control.model.geometry import direct_geometry
from fivebar_control.model.kinematics import det_a, leg_from_joints, platform_acceleration
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import Leg, State
from fivebar_description.parameters import FiveBar, LegParameters


class MotorMotion(NamedTuple):
    """Angles (rad), rates (rad/s) and accelerations (rad/s^2) of both motors."""

    q11: float
    q21: float
    dq11: float
    dq21: float
    ddq11: float
    ddq21: float


class PlatformLoad(NamedTuple):
    """What the platform adds to a motion of the motors.

    Attributes:
        load1, load2: motor torques per mass of the platform (Nm/kg), rows of J^T xddot.
        kappa: 1 / cond(A), from 0 on the Type 2 locus to 1.
    """

    load1: float
    load2: float
    kappa: float


NOWHERE = PlatformLoad(math.nan, math.nan, 0.0)


def platform_load(robot: FiveBar, assembly: int, motion: MotorMotion) -> PlatformLoad:
    """Return the platform's load in an assembly mode (the sign of det A).

    Depends on the robot's lengths only. `NOWHERE` where the distal links cannot meet, and on the Type 2 locus.
    """
    x, y = direct_geometry(robot, assembly, motion.q11, motion.q21)
    if math.isnan(x):
        return NOWHERE
    q12, q22 = _passive(robot.leg1, motion.q11, x, y), _passive(robot.leg2, motion.q21, x, y)
    still = State(
        leg_from_joints(robot.leg1, motion.q11, q12, 0.0, 0.0),
        leg_from_joints(robot.leg2, motion.q21, q22, 0.0, 0.0),
        x,
        y,
        0.0,
        0.0,
    )
    if det_a(still) == 0.0:
        return NOWHERE
    # without speed c is zero, and what J does to accelerations it does to speeds
    vx, vy = platform_acceleration(still, motion.dq11, motion.dq21)
    state = State(
        _moving(robot.leg1, still.leg1, motion.dq11, vx, vy),
        _moving(robot.leg2, still.leg2, motion.dq21, vx, vy),
        x,
        y,
        vx,
        vy,
    )
    lambda1, lambda2 = multipliers(
        robot._replace(mass=1.0), state, *platform_acceleration(state, motion.ddq11, motion.ddq21)
    )
    return PlatformLoad(state.leg1.b * lambda1, state.leg2.b * lambda2, inverse_condition(state))


def _passive(leg: LegParameters, q1: float, x: float, y: float) -> float:
    """Return q_i2 (rad) of a leg whose elbow and platform are known."""
    along_x = x - leg.base_x - leg.proximal * math.cos(q1)
    along_y = y - leg.proximal * math.sin(q1)
    return math.atan2(along_y, along_x) - q1


def _moving(parameters: LegParameters, leg: Leg, dq1: float, vx: float, vy: float) -> Leg:
    """Return a leg with its rates; across the distal link l_i2 dtheta_i = (xdot - elbow's speed) . (-u_y, u_x)."""
    across = leg.u_x * vy - leg.u_y * vx - parameters.proximal * leg.cos_q2 * dq1
    return leg_from_joints(parameters, leg.q1, leg.q2, dq1, across / parameters.distal - dq1)
