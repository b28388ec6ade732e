# SPDX-License-Identifier: Apache-2.0
"""The reference of the controllers: the motion of the platform and of both legs."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.model.dynamics import inverse_dynamics
from fivebar_control.model.kinematics import det_a, joint_acceleration, leg_with_rates, state_from_platform
from fivebar_control.model.state import Platform, State, WorkingMode
from fivebar_description.parameters import FiveBar, external_acceleration, has_external_force, lost_torque

DAMPING = 0.02
"""Damping of det A in `held_torque`: the torque is whole where det A is much larger."""


class Reference(NamedTuple):
    """The desired instant.

    Attributes:
        state: desired legs and platform.
        ax, ay: desired platform acceleration (m/s^2).
        f1, f2: friction (Nm) at the desired motor speeds, with known cogging and the weight of the legs.
            Compensating friction with the reference's speed instead of the measured one keeps noise and the change of
            sign at rest out of the loop.
        by_motors: whether the motion was planned in the motors' angles.
        u1, u2: torques beyond f (Nm) of such a motion, and of any motion where gravity or a constant force acts
            (`held_torque`); 0 for any other.
    """

    state: State
    ax: float
    ay: float
    f1: float
    f2: float
    by_motors: bool = False
    u1: float = 0.0
    u2: float = 0.0


def reference_from_platform(robot: FiveBar, mode: WorkingMode, platform: Platform) -> Reference:
    """Return the desired instant for a platform motion in a working mode."""
    state = state_from_platform(robot, mode, platform.x, platform.y, platform.vx, platform.vy)
    u1, u2 = held_torque(robot, state, platform.ax, platform.ay)
    return Reference(
        state=state,
        ax=platform.ax,
        ay=platform.ay,
        f1=lost_torque(robot, robot.leg1, state.leg1.q1, state.leg1.dq1),
        f2=lost_torque(robot, robot.leg2, state.leg2.q1, state.leg2.dq1),
        by_motors=False,
        u1=u1,
        u2=u2,
    )


def held_torque(robot: FiveBar, state: State, ax: float, ay: float) -> tuple[float, float]:
    """Return the torques beyond f (Nm) of a motion under gravity or a constant force, 0 without these.

    Near the Type 2 locus the inverse of A is damped, and at Type 1 there are none, so that they are bounded for any
    motion; one that meets the dynamic criterion keeps them nearly whole.

    Args:
        robot: nominal robot of the controllers.
        state: desired state.
        ax, ay: desired platform acceleration (m/s^2).
    """
    leg1, leg2 = state.leg1, state.leg2
    if not has_external_force(robot) or leg1.b == 0.0 or leg2.b == 0.0:
        return 0.0, 0.0
    fall_x, fall_y = external_acceleration(robot)
    b_x, b_y, determinant = ax - fall_x, ay - fall_y, det_a(state)
    scale = robot.mass * determinant / (determinant * determinant + DAMPING * DAMPING)
    return (
        robot.leg1.inertia * joint_acceleration(leg1, ax, ay) + leg1.b * scale * (leg2.u_y * b_x - leg2.u_x * b_y),
        robot.leg2.inertia * joint_acceleration(leg2, ax, ay) + leg2.b * scale * (leg1.u_x * b_y - leg1.u_y * b_x),
    )


def against_disturbance(reference: Reference, d1: float, d2: float) -> Reference:
    """Return a desired instant whose friction compensates disturbance torques d (Nm) that act on the motors too.

    Every law adds the friction f to the torque of its model; with tau + d acting on the motors it must add f - d.
    """
    return Reference(
        state=reference.state,
        ax=reference.ax,
        ay=reference.ay,
        f1=reference.f1 - d1,
        f2=reference.f2 - d2,
        by_motors=reference.by_motors,
        u1=reference.u1,
        u2=reference.u2,
    )


def reference_from_motors(robot: FiveBar, state: State, ax: float, ay: float, ddq11: float, ddq21: float) -> Reference:
    """Return the desired instant of a motion that was planned in the motors' angles.

    Regular at Type 1, where the platform's motion does not determine the motors'; NaN on the Type 2 locus.

    Args:
        robot: nominal robot of the controllers.
        state: desired state.
        ax, ay: desired platform acceleration (m/s^2).
        ddq11, ddq21: desired motor accelerations (rad/s^2).
    """
    u1, u2 = inverse_dynamics(robot, state, ddq11, ddq21, 0.0, 0.0)
    return Reference(
        state=state,
        ax=ax,
        ay=ay,
        f1=lost_torque(robot, robot.leg1, state.leg1.q1, state.leg1.dq1),
        f2=lost_torque(robot, robot.leg2, state.leg2.q1, state.leg2.dq1),
        by_motors=True,
        u1=u1,
        u2=u2,
    )


def reference_at_rest(robot: FiveBar, state: State) -> Reference:
    """Return the desired instant of a robot at rest, regardless of the speeds of the state's legs."""
    u1, u2 = held_torque(robot, at_rest(robot, state), 0.0, 0.0)
    return Reference(
        state=state,
        ax=0.0,
        ay=0.0,
        f1=lost_torque(robot, robot.leg1, state.leg1.q1, 0.0),
        f2=lost_torque(robot, robot.leg2, state.leg2.q1, 0.0),
        by_motors=False,
        u1=u1,
        u2=u2,
    )


def at_rest(robot: FiveBar, state: State) -> State:
    """Return a state without its motion."""
    leg1, leg2 = (
        leg_with_rates(robot.leg1, state.leg1, 0.0, 0.0),
        leg_with_rates(robot.leg2, state.leg2, 0.0, 0.0),
    )
    return State(leg1, leg2, state.x, state.y, 0.0, 0.0)
