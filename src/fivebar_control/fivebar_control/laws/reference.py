"""The reference of the controllers: the motion of the platform and of both legs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.model.dynamics import inverse_dynamics
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import Leg, Platform, State
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


LEG_VALUES = len(Leg._fields)
REFERENCE_VALUES = 2 * LEG_VALUES + 4 + len(Reference._fields) - 1
"""Numbers of a leg and of a desired instant in the row of an array."""


def write_reference(reference: Reference, row: NDArray[np.float64]) -> None:
    """Write a desired instant into a row, [REFERENCE_VALUES]: both legs, the platform, and the rest in order."""
    state = reference.state
    for index, value in enumerate(state.leg1):
        row[index] = value
    for index, value in enumerate(state.leg2):
        row[LEG_VALUES + index] = value
    row[24], row[25], row[26], row[27] = state.x, state.y, state.vx, state.vy
    row[28], row[29], row[30], row[31] = reference.ax, reference.ay, reference.f1, reference.f2
    row[32], row[33], row[34] = 1.0 if reference.by_motors else 0.0, reference.u1, reference.u2


def reference_of(row: NDArray[np.float64] | Sequence[float]) -> Reference:
    """Return the desired instant of such a row."""
    r = row
    leg1 = Leg(r[0], r[1], r[2], r[3], r[4], r[5], r[6], r[7], r[8], r[9], r[10], r[11])
    leg2 = Leg(r[12], r[13], r[14], r[15], r[16], r[17], r[18], r[19], r[20], r[21], r[22], r[23])
    return Reference(
        State(leg1, leg2, r[24], r[25], r[26], r[27]), r[28], r[29], r[30], r[31], r[32] != 0.0, r[33], r[34]
    )


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
