# SPDX-License-Identifier: Apache-2.0
"""A supply whose voltage falls with the power that the motors take, and the torque of both with it."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting


class Supply(NamedTuple):
    """A common supply of both drives that sags, so that they make less torque than they are set to.

    Power is that of the torque which the drives are set to: mechanical power of both motors together and the heat of
    their windings. Power that they give back does not raise the torque.
    """

    half_power: Annotated[
        float,
        Setting(
            "Power at which half of the torque is left, 0 for one that does not sag; typical: 200, 50 for a small one.",
            "W",
            at_least=0.0,
            at_most=1e6,
        ),
    ] = 0.0
    winding_loss: Annotated[
        float,
        Setting(
            "Heat of a motor's windings, over its squared torque at the joint; typical: 2 to 20.",
            "W/(Nm)^2",
            at_least=0.0,
            at_most=1e6,
        ),
    ] = 5.0


def supplied_share(supply: Supply, torque1: float, speed1: float, torque2: float, speed2: float) -> float:
    """Return which share of the torques (Nm) that the drives are set to is made at the motors' speeds (rad/s)."""
    if supply.half_power == 0.0:
        return 1.0
    power = torque1 * speed1 + torque2 * speed2
    power += supply.winding_loss * (torque1 * torque1 + torque2 * torque2)
    return supply.half_power / (supply.half_power + power) if power > 0.0 else 1.0
