"""The reference of the controllers: the motion of the platform and of both legs."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.model.dynamics import inverse_dynamics
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import Platform, State
from fivebar_description.friction import lost_torque
from fivebar_description.parameters import FiveBar


class Reference(NamedTuple):
    """The desired instant.

    Attributes:
        state: desired legs and platform.
        ax, ay: desired platform acceleration (m/s^2).
        f1, f2: friction (Nm) at the desired motor speeds. Compensating friction with the reference's speed instead of
            the measured one keeps noise and the change of sign at rest out of the loop.
        by_motors: whether the motion was planned in the motors' angles.
        u1, u2: torques beyond friction (Nm) of such a motion, 0 for any other.
    """

    state: State
    ax: float
    ay: float
    f1: float
    f2: float
    by_motors: bool = False
    u1: float = 0.0
    u2: float = 0.0


def reference_from_platform(robot: FiveBar, mode1: int, mode2: int, platform: Platform) -> Reference:
    """Return the desired instant for a platform motion in a working mode."""
    state = state_from_platform(robot, mode1, mode2, platform.x, platform.y, platform.vx, platform.vy)
    return Reference(
        state=state,
        ax=platform.ax,
        ay=platform.ay,
        f1=lost_torque(robot.leg1, state.leg1.q1, state.leg1.dq1),
        f2=lost_torque(robot.leg2, state.leg2.q1, state.leg2.dq1),
        by_motors=False,
        u1=0.0,
        u2=0.0,
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
        f1=lost_torque(robot.leg1, state.leg1.q1, state.leg1.dq1),
        f2=lost_torque(robot.leg2, state.leg2.q1, state.leg2.dq1),
        by_motors=True,
        u1=u1,
        u2=u2,
    )


def reference_at_rest(robot: FiveBar, state: State) -> Reference:
    """Return the desired instant of a robot at rest, regardless of the speeds of the state's legs."""
    return Reference(
        state=state,
        ax=0.0,
        ay=0.0,
        f1=lost_torque(robot.leg1, state.leg1.q1, 0.0),
        f2=lost_torque(robot.leg2, state.leg2.q1, 0.0),
        by_motors=False,
        u1=0.0,
        u2=0.0,
    )
