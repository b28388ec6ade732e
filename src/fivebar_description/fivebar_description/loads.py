# SPDX-License-Identifier: Apache-2.0
"""Actions on a robot from outside: the known `forces` of a robot file, and the `loads` that it has to bear."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.imu import STANDARD_GRAVITY
from fivebar_description.parameters import MOST_PAYLOAD
from fivebar_description.settings import Setting

Moment = Setting(
    "First mass moment of leg's proximal link about its motor axis, with the mass of the distal link at the elbow;"
    " needed with a tilt, except where `proximal_links` say it. 0 for a leg that is balanced.",
    "kg m",
    at_least=-10.0,
    at_most=10.0,
)


class Forces(NamedTuple):
    """Forces that act all the time and are known: gravity in the robot's plane, a payload, and a constant force.

    Laws, planner, estimator and simulated robots all count with them. What is not known of them, in any direction,
    belongs in `loads`.
    """

    tilt: Annotated[
        float,
        Setting(
            "Angle between the robot's plane and the horizontal: 1.5708 for a vertical robot.",
            "rad",
            at_least=0.0,
            at_most=1.571,
        ),
    ] = 0.0
    downhill: Annotated[
        float,
        Setting(
            "Direction of gravity in the plane, from the x axis: -1.5708 where y points uphill.",
            "rad",
            at_least=-2.0 * math.pi,
            at_most=2.0 * math.pi,
        ),
    ] = -math.pi / 2.0
    moment_1: Annotated[float | None, Moment] = None
    moment_2: Annotated[float | None, Moment] = None
    payload: Annotated[
        float,
        Setting("Mass that the platform always carries, beside `mass_kg`.", "kg", at_least=0.0, at_most=MOST_PAYLOAD),
    ] = 0.0
    force_x: Annotated[
        float, Setting("Constant force on the platform along x, as of a cable.", "N", at_least=-1e4, at_most=1e4)
    ] = 0.0
    force_y: Annotated[float, Setting("The same along y.", "N", at_least=-1e4, at_most=1e4)] = 0.0

    def gravity(self) -> tuple[float, float]:
        """Return gravity in the robot's plane (m/s^2)."""
        if self.tilt == 0.0:
            return 0.0, 0.0
        along = STANDARD_GRAVITY * math.sin(self.tilt)
        return along * math.cos(self.downhill), along * math.sin(self.downhill)


NO_FORCES = Forces()
"""A level robot that nothing pulls."""


class Loads(NamedTuple):
    """Loads that the robot has to bear at once, in whatever direction is worst; 0 for none.

    No motor acts along t_s on the Type 2 locus, so there only a quick passage keeps them from moving the platform. The
    screen refuses crossings that are too slow for them (`risk.load_share`), and the planner makes them quicker.
    Typical: 0.035 rad of tilt, 1 N for 50 ms from a cable that drags, 0.003 Nm in each ball bearing. A section that is
    left out, or has the defaults only, is that of the robot's file; one with any other value replaces it as a whole.
    """

    tilt: Annotated[
        float,
        Setting("Tilt of the base, in any direction.", "rad", at_least=0.0, at_most=0.6),
    ] = 0.0
    push: Annotated[
        float,
        Setting(
            "Force on the platform, in any direction, about the moment of a crossing.", "N", at_least=0.0, at_most=1e4
        ),
    ] = 0.0
    push_length: Annotated[float, Setting("How long the force lasts.", "s", at_least=0.0, at_most=10.0)] = 0.05
    passive: Annotated[
        float, Setting("Coulomb friction of each of the three passive joints.", "Nm", at_least=0.0, at_most=10.0)
    ] = 0.0

    @property
    def declared(self) -> bool:
        """Whether there is any load to bear."""
        return self.tilt > 0.0 or self.push > 0.0 or self.passive > 0.0


NO_LOADS = Loads()
"""Nothing to bear."""
