# SPDX-License-Identifier: Apache-2.0
"""The plant between two samples: the integration of `fivebar_sim.plant` with the analytic dynamics, in scalars.

Same coordinates (the four joint angles), same Runge-Kutta steps, same halving, same projection onto the closed loop, so
that the two plants differ by rounding only. The unit vectors of the links are updated by the small rotations
of a step instead of being computed from the angles, since sines and cosines would dominate the cost.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.model.dynamics import direct_dynamics
from fivebar_control.model.kinematics import distal_acceleration_by_motor
from fivebar_control.model.state import Leg, State
from fivebar_description.parameters import FiveBar, LegParameters, friction_torque, has_external_force, weight_torque
from fivebar_sim.plant import CLOSURE_TOLERANCE, MAX_HALVINGS

SMALL_ANGLE = 0.0625
"""Up to this angle (rad) the series in :func:`turned` are exact to rounding."""

WHOLE_STEP = 2**MAX_HALVINGS
"""Parts of a step, of which the shortest step is one."""


class Direction(NamedTuple):
    """A unit vector."""

    x: float
    y: float


class LegState(NamedTuple):
    """One leg on its own: angles (rad), rates (rad/s) as in `joint_states`, directions of both links."""

    q1: float
    q2: float
    dq1: float
    dq2: float
    proximal: Direction
    distal: Direction


class PlantState(NamedTuple):
    """Both legs."""

    leg1: LegState
    leg2: LegState


class Closed(NamedTuple):
    """A state on the closed loop, and the gap (m) that was found before it was closed."""

    state: PlantState
    gap: float


class Rates(NamedTuple):
    """Accelerations of the four joints (rad/s^2)."""

    ddq11: float
    ddq12: float
    ddq21: float
    ddq22: float


def chain_at(q1: float, q2: float, dq1: float, dq2: float) -> LegState:
    """Return a leg from its joint angles and rates."""
    theta = q1 + q2
    return LegState(
        q1, q2, dq1, dq2, Direction(math.cos(q1), math.sin(q1)), Direction(math.cos(theta), math.sin(theta))
    )


def turned(direction: Direction, angle: float) -> Direction:
    """Return a direction turned by an angle (rad)."""
    if abs(angle) <= SMALL_ANGLE:
        a = angle * angle
        sin = angle * (1.0 - a * (1.0 / 6.0) * (1.0 - a * (1.0 / 20.0) * (1.0 - a * (1.0 / 42.0))))
        cos = 1.0 - a * 0.5 * (1.0 - a * (1.0 / 12.0) * (1.0 - a * (1.0 / 30.0) * (1.0 - a * (1.0 / 56.0))))
    else:
        sin, cos = math.sin(angle), math.cos(angle)
    return Direction(direction.x * cos - direction.y * sin, direction.x * sin + direction.y * cos)


def joint_accelerations(robot: FiveBar, state: PlantState, tau1: float, tau2: float) -> Rates:
    """Return the joint accelerations under motor torques (Nm) and friction; regular at Types 1 and 2."""
    leg1, leg2 = _leg(robot.leg1, state.leg1), _leg(robot.leg2, state.leg2)
    # the dynamics need no place of the platform
    both = State(leg1, leg2, math.nan, math.nan, math.nan, math.nan)
    f1, f2 = friction_torque(robot.leg1, leg1.dq1), friction_torque(robot.leg2, leg2.dq1)
    if has_external_force(robot):
        f1 += weight_torque(robot, robot.leg1, leg1.r_x, leg1.r_y)
        f2 += weight_torque(robot, robot.leg2, leg2.r_x, leg2.r_y)
    motion = direct_dynamics(robot, both, tau1, tau2, f1, f2)
    ddtheta1 = distal_acceleration_by_motor(robot.leg1, leg1, motion.ddq11, motion.ax, motion.ay)
    ddtheta2 = distal_acceleration_by_motor(robot.leg2, leg2, motion.ddq21, motion.ax, motion.ay)
    return Rates(motion.ddq11, ddtheta1 - motion.ddq11, motion.ddq21, ddtheta2 - motion.ddq21)


def _leg(leg: LegParameters, chain: LegState) -> Leg:
    r, u = chain.proximal, chain.distal
    dtheta = chain.dq1 + chain.dq2
    cos_q2, sin_q2 = r.x * u.x + r.y * u.y, r.x * u.y - r.y * u.x
    return Leg(
        q1=chain.q1,
        q2=chain.q2,
        dq1=chain.dq1,
        dtheta=dtheta,
        r_x=r.x,
        r_y=r.y,
        u_x=u.x,
        u_y=u.y,
        cos_q2=cos_q2,
        sin_q2=sin_q2,
        b=leg.proximal * sin_q2,
        c=leg.distal * dtheta * dtheta + leg.proximal * cos_q2 * chain.dq1 * chain.dq1,
    )


def moved(chain: LegState, d1: float, d2: float, dq1: float, dq2: float) -> LegState:
    """Return a leg whose joints have turned by small angles (rad), with other rates (rad/s)."""
    return LegState(chain.q1 + d1, chain.q2 + d2, dq1, dq2, turned(chain.proximal, d1), turned(chain.distal, d1 + d2))


def closed(robot: FiveBar, state: PlantState) -> Closed:
    """Put a state back onto the closed loop: one Gauss-Newton step for the angles, a projection for the rates."""
    leg1, leg2 = state
    l_11, l_12, l_21, l_22 = robot.leg1.proximal, robot.leg1.distal, robot.leg2.proximal, robot.leg2.distal
    # the columns of the gap's Jacobian are (-y, x) of the lever from each joint to its tip
    p1_x, p1_y = l_12 * leg1.distal.x, l_12 * leg1.distal.y
    m1_x, m1_y = l_11 * leg1.proximal.x + p1_x, l_11 * leg1.proximal.y + p1_y
    p2_x, p2_y = l_22 * leg2.distal.x, l_22 * leg2.distal.y
    m2_x, m2_y = l_21 * leg2.proximal.x + p2_x, l_21 * leg2.proximal.y + p2_y
    gap_x, gap_y = robot.leg1.base_x + m1_x - robot.leg2.base_x - m2_x, m1_y - m2_y
    open_x = -m1_y * leg1.dq1 - p1_y * leg1.dq2 + m2_y * leg2.dq1 + p2_y * leg2.dq2
    open_y = m1_x * leg1.dq1 + p1_x * leg1.dq2 - m2_x * leg2.dq1 - p2_x * leg2.dq2
    n_xx = m1_y * m1_y + p1_y * p1_y + m2_y * m2_y + p2_y * p2_y
    n_yy = m1_x * m1_x + p1_x * p1_x + m2_x * m2_x + p2_x * p2_x
    n_xy = -(m1_x * m1_y + p1_x * p1_y + m2_x * m2_y + p2_x * p2_y)
    inverse = 1.0 / (n_xx * n_yy - n_xy * n_xy)
    a_x, a_y = (n_yy * gap_x - n_xy * gap_y) * inverse, (n_xx * gap_y - n_xy * gap_x) * inverse
    v_x, v_y = (n_yy * open_x - n_xy * open_y) * inverse, (n_xx * open_y - n_xy * open_x) * inverse
    return Closed(
        PlantState(
            moved(
                leg1,
                m1_y * a_x - m1_x * a_y,
                p1_y * a_x - p1_x * a_y,
                leg1.dq1 + m1_y * v_x - m1_x * v_y,
                leg1.dq2 + p1_y * v_x - p1_x * v_y,
            ),
            moved(
                leg2,
                m2_x * a_y - m2_y * a_x,
                p2_x * a_y - p2_y * a_x,
                leg2.dq1 + m2_x * v_y - m2_y * v_x,
                leg2.dq2 + p2_x * v_y - p2_y * v_x,
            ),
        ),
        math.sqrt(gap_x * gap_x + gap_y * gap_y),
    )


def stepped(robot: FiveBar, state: PlantState, h: float, tau1: float, tau2: float) -> Closed:
    """Return the state one Runge-Kutta step of h (s) later under motor torques (Nm), on the closed loop."""
    leg1, leg2 = state
    half = 0.5 * h
    v11, v12, v21, v22 = leg1.dq1, leg1.dq2, leg2.dq1, leg2.dq2
    a = joint_accelerations(robot, state, tau1, tau2)
    u11, u12, u21, u22 = v11 + half * a.ddq11, v12 + half * a.ddq12, v21 + half * a.ddq21, v22 + half * a.ddq22
    stage = PlantState(moved(leg1, half * v11, half * v12, u11, u12), moved(leg2, half * v21, half * v22, u21, u22))
    b = joint_accelerations(robot, stage, tau1, tau2)
    w11, w12, w21, w22 = v11 + half * b.ddq11, v12 + half * b.ddq12, v21 + half * b.ddq21, v22 + half * b.ddq22
    stage = PlantState(moved(leg1, half * u11, half * u12, w11, w12), moved(leg2, half * u21, half * u22, w21, w22))
    c = joint_accelerations(robot, stage, tau1, tau2)
    z11, z12, z21, z22 = v11 + h * c.ddq11, v12 + h * c.ddq12, v21 + h * c.ddq21, v22 + h * c.ddq22
    stage = PlantState(moved(leg1, h * w11, h * w12, z11, z12), moved(leg2, h * w21, h * w22, z21, z22))
    d = joint_accelerations(robot, stage, tau1, tau2)
    sixth = h / 6.0
    after = PlantState(
        moved(
            leg1,
            sixth * (v11 + 2.0 * (u11 + w11) + z11),
            sixth * (v12 + 2.0 * (u12 + w12) + z12),
            v11 + sixth * (a.ddq11 + 2.0 * (b.ddq11 + c.ddq11) + d.ddq11),
            v12 + sixth * (a.ddq12 + 2.0 * (b.ddq12 + c.ddq12) + d.ddq12),
        ),
        moved(
            leg2,
            sixth * (v21 + 2.0 * (u21 + w21) + z21),
            sixth * (v22 + 2.0 * (u22 + w22) + z22),
            v21 + sixth * (a.ddq21 + 2.0 * (b.ddq21 + c.ddq21) + d.ddq21),
            v22 + sixth * (a.ddq22 + 2.0 * (b.ddq22 + c.ddq22) + d.ddq22),
        ),
    )
    return closed(robot, after)


def advanced_plant(robot: FiveBar, state: PlantState, steps: int, h: float, tau1: float, tau2: float) -> Closed:
    """Return the state after so many steps of h (s) with the largest gap (m) on the way.

    A step that opens the loop by more than the plant's tolerance is repeated in halves. The gap is infinite where even
    the shortest steps exceed it: the motion is too fast to be simulated.
    """
    widest = 0.0
    leg1, leg2 = state
    # recompute the incrementally rotated directions from the angles, so that rounding does not accumulate
    state = PlantState(chain_at(leg1.q1, leg1.q2, leg1.dq1, leg1.dq2), chain_at(leg2.q1, leg2.q2, leg2.dq1, leg2.dq2))
    for _ in range(steps):
        done, part = 0, WHOLE_STEP
        while done < WHOLE_STEP:
            after = stepped(robot, state, h * part / WHOLE_STEP, tau1, tau2)
            if after.gap <= CLOSURE_TOLERANCE:
                state = after.state
                widest = max(widest, after.gap)
                done += part
                while part < WHOLE_STEP and done % (2 * part) == 0:
                    part *= 2
            elif part > 1:
                part //= 2
            else:
                return Closed(state, math.inf)
    return Closed(state, widest)
