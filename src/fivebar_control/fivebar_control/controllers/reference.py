"""The reference as the controllers need it: the platform's motion and, through the inverse geometry, both legs'."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.model.friction import friction_torque
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.model.state import Platform, State
from fivebar_description.parameters import FiveBar


class Reference(NamedTuple):
    """The desired instant.

    Attributes:
        state: desired legs and platform.
        ax, ay: desired platform acceleration (m/s^2).
        f1, f2: friction (Nm) at the desired motor speeds. Compensating friction with the reference's speed instead of
            the measured one keeps noise and the change of sign at rest out of the loop.
    """

    state: State
    ax: float
    ay: float
    f1: float
    f2: float


def reference_from_platform(robot: FiveBar, mode1: int, mode2: int, platform: Platform) -> Reference:
    """Return the desired instant for a platform motion in a working mode."""
    state = state_from_platform(robot, mode1, mode2, platform.x, platform.y, platform.vx, platform.vy)
    return Reference(
        state=state,
        ax=platform.ax,
        ay=platform.ay,
        f1=friction_torque(robot.leg1, state.leg1.dq1),
        f2=friction_torque(robot.leg2, state.leg2.dq1),
    )
