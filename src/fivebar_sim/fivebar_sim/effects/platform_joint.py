# SPDX-License-Identifier: Apache-2.0
"""An elastic joint with clearance at the platform, where both distal links meet."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting


class PlatformJoint(NamedTuple):
    """Spring, damper and clearance between the tips of both legs, each of which carries half of the platform's mass.

    The stiffness stands for all compliance between the motor axes: bearings, links and frame. A platform that is part
    of one link would have its mass at one tip; both forms are equal as long as the joint is stiff, and the
    halves make the model symmetric.
    """

    stiffness: Annotated[
        float,
        Setting(
            "Stiffness of the closed loop in either direction, 0 for a rigid one; typical: 1e6 for steel bearings, 1e5"
            " for printed links.",
            "N/m",
            at_least=0.0,
            at_most=1e9,
        ),
    ] = 0.0
    damping: Annotated[
        float,
        Setting(
            "Damping ratio of both halves of the platform against each other; typical: 0.02 to 0.1.",
            at_least=0.0,
            at_most=2.0,
        ),
    ] = 0.05
    clearance: Annotated[
        float,
        Setting("Radial play of the joint; typical: 5e-6 to 5e-5.", "m", at_least=0.0, at_most=0.01),
    ] = 0.0


class Force(NamedTuple):
    """A force in the plane (N)."""

    x: float
    y: float


def joint_force(
    stiffness: float, damping: float, clearance: float, gap_x: float, gap_y: float, rate_x: float, rate_y: float
) -> Force:
    """Return the force (N) on the tip of leg 2, whose opposite acts on leg 1.

    `gap` (m) goes from the tip of leg 2 to that of leg 1, `rate` (m/s) is its derivative. With clearance the pin
    touches its bore along the gap; the damper acts while they touch, and the contact never pulls.
    """
    if clearance == 0.0:
        return Force(stiffness * gap_x + damping * rate_x, stiffness * gap_y + damping * rate_y)
    gap = math.sqrt(gap_x * gap_x + gap_y * gap_y)
    if gap <= clearance:
        return Force(0.0, 0.0)
    n_x, n_y = gap_x / gap, gap_y / gap
    normal = stiffness * (gap - clearance) + damping * (n_x * rate_x + n_y * rate_y)
    if normal <= 0.0:
        return Force(0.0, 0.0)
    sliding = damping * (n_x * rate_y - n_y * rate_x)
    return Force(normal * n_x - sliding * n_y, normal * n_y + sliding * n_x)
