# SPDX-License-Identifier: Apache-2.0
"""A cable to the platform, such as that of a gripper: its weight and drag, and the pull of a stretched one."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting
from fivebar_sim.effects.platform_joint import Force


def _place(axis: str) -> Setting:
    return Setting(f"{axis} of the anchor, in the robot's frame.", "m", at_least=-10.0, at_most=10.0)


class Cable(NamedTuple):
    """A force on the platform that is always the same, and a spring between the platform and an anchor that only pulls.

    Unlike a push it lasts for the whole run, and the tension of the spring follows the platform.
    """

    force: Annotated[float, Setting("The constant force; typical: 0.1 to 0.5.", "N", at_least=0.0, at_most=1e4)] = 0.0
    heading: Annotated[
        float, Setting("Its direction, from the x axis.", "rad", at_least=-2.0 * math.pi, at_most=2.0 * math.pi)
    ] = 0.0
    stiffness: Annotated[
        float,
        Setting("Stiffness of the spring; typical: 5 to 20 for a loop of cable.", "N/m", at_least=0.0, at_most=1e6),
    ] = 0.0
    length: Annotated[
        float, Setting("Its length without tension, beyond which it pulls.", "m", at_least=0.0, at_most=10.0)
    ] = 0.0
    anchor_x: Annotated[float, _place("x")] = 0.0
    anchor_y: Annotated[float, _place("y")] = 0.3


def cable_force(cable: Cable, x: float, y: float) -> Force:
    """Return the force (N) on a platform at (x, y) m; `cable` as numbers."""
    if cable.force == 0.0 and cable.stiffness == 0.0:
        return Force(0.0, 0.0)
    along_x, along_y = cable.force * math.cos(cable.heading), cable.force * math.sin(cable.heading)
    if cable.stiffness == 0.0:
        return Force(along_x, along_y)
    to_x, to_y = cable.anchor_x - x, cable.anchor_y - y
    distance = math.sqrt(to_x * to_x + to_y * to_y)
    if distance <= cable.length or distance == 0.0:
        return Force(along_x, along_y)
    share = cable.stiffness * (distance - cable.length) / distance
    return Force(along_x + share * to_x, along_y + share * to_y)


def stretched_energy(cable: Cable, x: float, y: float) -> float:
    """Return the energy (J) in the spring with the platform at (x, y) m."""
    stretch = max(0.0, math.hypot(cable.anchor_x - x, cable.anchor_y - y) - cable.length)
    return 0.5 * cable.stiffness * stretch**2
