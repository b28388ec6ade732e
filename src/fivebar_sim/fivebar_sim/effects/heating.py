# SPDX-License-Identifier: Apache-2.0
"""Friction that changes as the motors' gears and bearings heat up by it."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting
from fivebar_sim.effects.friction import FrictionCurve, sliding_friction


class Heating(NamedTuple):
    """How the friction of each motor changes with the heat that it has made, which the motor loses again with time.

    Coulomb and viscous friction and the offset all change in proportion.
    """

    change: Annotated[
        float,
        Setting(
            "Relative change of a hot motor's friction; typical: -0.3 where grease thins, 0.2 where bearings tighten.",
            at_least=-0.95,
            at_most=10.0,
        ),
    ] = 0.0
    work: Annotated[
        float,
        Setting(
            "Work of the friction after which 63 % of the change is reached; typical: 5 to 500.",
            "J",
            at_least=1e-3,
            at_most=1e6,
        ),
    ] = 20.0
    cooling: Annotated[
        float,
        Setting("Time after which a motor at rest has lost 63 % of its heat.", "s", at_least=1e-2, at_most=1e6),
    ] = 300.0


def hot_share(heating: Heating, heat: float) -> float:
    """Return the friction of a motor relative to that of a cold one, with a heat (J) in it."""
    if heating.change == 0.0:
        return 1.0
    return 1.0 - heating.change * math.expm1(-heat / heating.work)


def heat_after(heating: Heating, curve: FrictionCurve, heat: float, moved: float, time: float) -> float:
    """Return the heat (J) of a motor with some friction after it has moved so far (rad) in a time (s)."""
    if heating.change == 0.0 or time == 0.0:
        return heat
    friction = hot_share(heating, heat) * sliding_friction(curve, moved / time)
    return heat * math.exp(-time / heating.cooling) + abs(friction * moved)
