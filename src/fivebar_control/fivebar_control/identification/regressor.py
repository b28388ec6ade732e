# SPDX-License-Identifier: Apache-2.0
"""The inverse dynamics as a product of known motion and unknown parameters.

tau = ZZ qddot + B lambda + f with A^T lambda = m xddot (1.30, 1.31) and the friction of 1.32 is linear in zz_11R,
zz_21R, m, f_s and f_off of both motors. So are viscous friction, and the Coulomb friction of the passive joints, whose
torques act on the motors by how fast these joints turn with each motor. The motors' angles and their derivatives are
all that it takes: the direct geometry gives the platform in a known assembly mode, and J = A^-1 B its motion. No
passive joint is read, and a leg may pass through Type 1. Residual inertias of the distal links are not identified: they
follow from weighing the links, and what they need of torque is taken off beforehand. So is what a constant
force needs, and the weight of the legs; that of the platform counts with its mass.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.dynamics import multipliers
from fivebar_control.model.kinematics import platform_acceleration, state_from_motors
from fivebar_control.model.residual import distal_moments, moment_multipliers, moment_torques
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import MotorMotion, State
from fivebar_description.parameters import FiveBar, has_external_force, has_residual, weight_torque


class PlatformLoad(NamedTuple):
    """The platform's load on the motors during a motion.

    Attributes:
        load1, load2: motor torques per mass of the platform (Nm/kg), rows of J^T xddot.
        known1, known2: motor torques (Nm) that are taken as known: of the distal links' residual inertias, a constant
            force and the weight of the legs.
        passive1, passive2: motor torques per Coulomb friction of each of the three passive joints.
        kappa: 1 / cond(A), from 0 on the Type 2 locus to 1.
    """

    load1: float
    load2: float
    known1: float
    known2: float
    passive1: float
    passive2: float
    kappa: float


NOWHERE = PlatformLoad(math.nan, math.nan, math.nan, math.nan, math.nan, math.nan, 0.0)


def platform_load(robot: FiveBar, assembly: int, motion: MotorMotion) -> PlatformLoad:
    """Return the platform's load in an assembly mode (the sign of det A).

    Depends on the robot's lengths and residual inertias only. `NOWHERE` where the distal links cannot meet, and on the
    Type 2 locus.
    """
    state = state_from_motors(robot, assembly, motion.q11, motion.q21, motion.dq11, motion.dq21)
    if math.isnan(state.x):
        return NOWHERE
    ax, ay = platform_acceleration(state, motion.ddq11, motion.ddq21)
    lambda1, lambda2 = multipliers(robot._replace(mass=1.0, force_x=0.0, force_y=0.0), state, ax, ay)
    known1 = known2 = 0.0
    if has_external_force(robot) and not math.isnan(ax):
        # lambda by the force alone: of a platform of 1 kg that neither accelerates nor weighs
        pulled = robot._replace(mass=1.0, gravity_x=0.0, gravity_y=0.0)
        held1, held2 = multipliers(pulled, state, 0.0, 0.0)
        leg1, leg2 = state.leg1, state.leg2
        known1 = leg1.b * held1 + weight_torque(robot, robot.leg1, leg1.r_x, leg1.r_y)
        known2 = leg2.b * held2 + weight_torque(robot, robot.leg2, leg2.r_x, leg2.r_y)
    if has_residual(robot) and not math.isnan(ax):
        moments = distal_moments(robot, state, motion.ddq11, motion.ddq21, ax, ay)
        on1, on2 = moment_torques(robot, state, moments)
        more1, more2 = moment_multipliers(robot, state, moments)
        known1, known2 = known1 + on1 + state.leg1.b * more1, known2 + on2 + state.leg2.b * more2
    signs = [math.tanh(rate / width) for rate, width in zip(passive_rates(state), widths(robot), strict=True)]
    passive1, passive2 = (
        sum(sign * rate for sign, rate in zip(signs, passive_rates(turning), strict=True))
        for turning in (
            state_from_motors(robot, assembly, motion.q11, motion.q21, 1.0, 0.0),
            state_from_motors(robot, assembly, motion.q11, motion.q21, 0.0, 1.0),
        )
    )
    return PlatformLoad(
        state.leg1.b * lambda1, state.leg2.b * lambda2, known1, known2, passive1, passive2, inverse_condition(state)
    )


def passive_rates(state: State) -> tuple[float, float, float]:
    """Return the rates (rad/s) of both elbows and of the joint at the platform."""
    leg1, leg2 = state.leg1, state.leg2
    return leg1.dtheta - leg1.dq1, leg2.dtheta - leg2.dq1, leg1.dtheta - leg2.dtheta


def widths(robot: FiveBar) -> tuple[float, float, float]:
    """Return the widths (rad/s) of the smoothed friction of the same joints."""
    return robot.leg1.width, robot.leg2.width, robot.leg1.width
