# SPDX-License-Identifier: Apache-2.0
"""Where a robot at rest stands by its motor encoders, and how to get one off the Type 2 locus.

The encoders give the elbows. Let D be their distance and L the one at which the distal links lie on one line: their sum
where they are stretched, the difference of their lengths where they are folded. The platform is off the elbows' line by
the height of the triangle of D and the distal links, to either side: both assembly modes fit the angles, and where
D - L is as small as its uncertainty, neither can be distinguished from the locus itself.

There no torque moves the platform along t_s. But motors that move the elbows away from L (together where the links are
stretched) leave it no place on the line: it falls to one side. The model does not say to which, friction and gravity
decide; the gyroscope on the distal link of leg 2 shows it by the sign of its rate.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.estimation.ekf import error_deviations
from fivebar_control.model.geometry import direct_geometry, elbow_position
from fivebar_control.model.singularity import STRETCHED, distal_links_of
from fivebar_description.parameters import FiveBar, largest_friction
from fivebar_description.tolerances import Tolerances

NEAR = 5e-3
"""Distance (m) from the elbows' line up to which a robot is held to be near the locus, whatever the tolerances."""

DEVIATIONS = 3.0
"""Standard deviations within which the elbows' distance may be that of the locus."""

PRESS = 2.0
"""Torque that moves the motors off the locus, in units of the larger Coulomb friction."""


class Standstill(NamedTuple):
    """A robot at rest, from its encoders.

    Attributes:
        stretched: how the distal links lie where the locus is nearest: stretched, else folded.
        gap: |D - L| (m), negative where the distal links cannot meet.
        gap_deviation: its standard deviation within the tolerances (m).
        side: distance of the platform from the elbows' line (m), 0 for a negative gap.
        side_at_most: the largest one within the tolerances (m).
        plus, minus: where the platform is in the assembly mode + or - (m).
        normal_x, normal_y: unit vector from the elbows' line to the side of assembly mode +.
        tau1, tau2: torques that move the elbows off the locus (Nm).
        turn: rate of leg 2's distal link per speed along the normal (rad/m).
    """

    stretched: bool
    gap: float
    gap_deviation: float
    side: float
    side_at_most: float
    plus: tuple[float, float]
    minus: tuple[float, float]
    normal_x: float
    normal_y: float
    tau1: float
    tau2: float
    turn: float

    @property
    def near(self) -> bool:
        """Whether the robot may be on the locus, or is so near that it must not be moved as usual."""
        return self.gap < DEVIATIONS * self.gap_deviation or self.side < NEAR


def standstill_at(robot: FiveBar, tolerances: Tolerances, q11: float, q21: float) -> Standstill | None:
    """Return where a robot stands with its motors at q11, q21 (rad); None where both elbows are in one place."""
    leg1, leg2 = robot.leg1, robot.leg2
    (x1, y1), (x2, y2) = elbow_position(leg1, q11), elbow_position(leg2, q21)
    distance = math.hypot(x2 - x1, y2 - y1)
    if distance == 0.0:
        return None
    e_x, e_y = (x2 - x1) / distance, (y2 - y1) / distance
    longest, shortest = leg1.distal + leg2.distal, abs(leg1.distal - leg2.distal)
    cosine = (leg1.distal**2 + leg2.distal**2 - distance * distance) / (2.0 * leg1.distal * leg2.distal)
    stretched = distal_links_of(cosine) == STRETCHED
    gap = longest - distance if stretched else distance - shortest
    # d D / d q_i and d D / d l_i1
    c1, s1, c2, s2 = math.cos(q11), math.sin(q11), math.cos(q21), math.sin(q21)
    by_q1, by_q2 = -leg1.proximal * (c1 * e_y - s1 * e_x), leg2.proximal * (c2 * e_y - s2 * e_x)
    along1, along2 = e_x * c1 + e_y * s1, e_x * c2 + e_y * s2
    known = error_deviations(tolerances)
    deviation = math.hypot(
        by_q1 * known.zero1,
        by_q2 * known.zero2,
        along1 * known.l_11,
        along2 * known.l_21,
        known.l_12,
        known.l_22,
        e_x * known.base1,
        e_x * known.base2,
    )
    centre = 0.5 * (distance + (leg1.distal - leg2.distal) * longest / distance)
    normal_x, normal_y = -e_y, e_x
    # the platform on the line, from which leg 2's distal link has its direction
    u_x, u_y = (x1 + centre * e_x - x2) / leg2.distal, (y1 + centre * e_y - y2) / leg2.distal
    sin_q22 = c2 * u_y - s2 * u_x
    turn = -(c2 * normal_x + s2 * normal_y) / (leg2.distal * sin_q22) if sin_q22 != 0.0 else math.nan
    press = (-1.0 if stretched else 1.0) * PRESS * largest_friction(robot) / max(abs(by_q1), abs(by_q2))
    return Standstill(
        stretched=stretched,
        gap=gap,
        gap_deviation=deviation,
        side=_height(robot, distance),
        side_at_most=_height(robot, distance + (-DEVIATIONS if stretched else DEVIATIONS) * deviation),
        plus=direct_geometry(robot, 1, q11, q21),
        minus=direct_geometry(robot, -1, q11, q21),
        normal_x=normal_x,
        normal_y=normal_y,
        tau1=press * by_q1,
        tau2=press * by_q2,
        turn=turn,
    )


def _height(robot: FiveBar, distance: float) -> float:
    """Return the platform's distance (m) from the line through elbows so far apart (m), 0 where it has none."""
    distal1, distal2 = robot.leg1.distal, robot.leg2.distal
    squared = ((distal1 + distal2) ** 2 - distance * distance) * (distance * distance - (distal1 - distal2) ** 2)
    return math.sqrt(max(squared, 0.0)) / (2.0 * distance)


def mode_by_turn(stand: Standstill, rate: float, noise: float) -> int:
    """Return to which assembly mode a robot falls, +1 or -1, by the gyroscope's rate (rad/s); 0 within its noise."""
    if not abs(rate) > noise or stand.turn == 0.0:
        return 0
    return 1 if rate * stand.turn > 0.0 else -1


def way_out(stand: Standstill) -> list[str]:
    """Return what to do with a robot that rests on or near the locus, sentence by sentence."""
    moved = "together" if stand.stretched else "apart"
    plus = "positive" if stand.turn > 0.0 else "negative"
    side = f"({stand.normal_x:+.2f}, {stand.normal_y:+.2f})"
    return [
        f"by hand, without motor power: push the platform along {side} into assembly mode +, or against it into -, by"
        f" {2e3 * max(NEAR, stand.side_at_most):.0f} mm, and home it there",
        f"by the motors, where somebody watches it: {stand.tau1:+.3f} Nm on motor 1 and {stand.tau2:+.3f} Nm on motor 2"
        f" move the elbows {moved}, and the platform falls to one side; which one the model does not say."
        " `fivebar posture --release` plans it, and the service blender/release does it",
        f"a gyroscope on the distal link of leg 2 shows it: a {plus} rate is the way into assembly mode +; the motor"
        " encoders read the same in both",
    ]
