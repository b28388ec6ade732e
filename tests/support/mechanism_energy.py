# SPDX-License-Identifier: Apache-2.0
"""The energy of the robot with effects, which its equations of motion do not use."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_sim.effects.body_dynamics import UNLOADED, LinkAngles, chain
from fivebar_sim.effects.cable import stretched_energy
from fivebar_sim.effects.mechanism import Mechanism
from fivebar_sim.effects.mechanism_state import MechanismState


class Energy(NamedTuple):
    """Energies (J): of motion, and in springs, a stretched cable and bristles."""

    kinetic: float
    elastic: float


def energy(mechanism: Mechanism, state: MechanismState) -> Energy:
    """Return the energy of a state."""
    at, rate, bristles = state.at, state.rate, state.bristles
    kinetic = elastic = 0.0
    ends = []
    for leg, q1, theta, dq1, dtheta, motor, speed, deflections in (
        (
            mechanism.leg1,
            at.link1,
            at.distal1,
            rate.link1,
            rate.distal1,
            at.rotor1,
            rate.rotor1,
            (bristles.motor1, bristles.elbow1),
        ),
        (
            mechanism.leg2,
            at.link2,
            at.distal2,
            rate.link2,
            rate.distal2,
            at.rotor2,
            rate.rotor2,
            (bristles.motor2, bristles.elbow2),
        ),
    ):
        cross = leg.coupling * math.cos(theta - q1)
        kinetic += 0.5 * (leg.inertia * dq1**2 + leg.distal_inertia * dtheta**2) + cross * dq1 * dtheta
        kinetic += 0.5 * leg.rotor * speed**2
        twist = max(0.0, abs(motor - q1) - mechanism.half_play) if mechanism.elastic else 0.0
        elastic += 0.5 * leg.stiffness * twist**2
        for curve, deflection in zip((leg.motor_friction, leg.elbow_friction), deflections, strict=True):
            elastic += 0.5 * curve.stiffness * deflection**2
        ends.append(chain(leg, LinkAngles(q1, theta, dq1, dtheta), UNLOADED))
    elastic += 0.5 * mechanism.platform_friction.stiffness * bristles.platform**2
    stretch = max(0.0, math.hypot(ends[0].x - ends[1].x, ends[0].y - ends[1].y) - mechanism.clearance)
    elastic += 0.5 * mechanism.joint_stiffness * stretch**2
    elastic += stretched_energy(mechanism.cable, 0.5 * (ends[0].x + ends[1].x), 0.5 * (ends[0].y + ends[1].y))
    return Energy(kinetic, elastic)
