"""The sensors' view of the robot with effects, and its energy."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_sim.effects.body_dynamics import accelerations, chain
from fivebar_sim.effects.cable import stretched_energy
from fivebar_sim.effects.encoders import EncoderReading
from fivebar_sim.effects.loads import felt_weight
from fivebar_sim.effects.mechanism import Mechanism
from fivebar_sim.effects.mechanism_state import MechanismState, PerBody


class JointMotion(NamedTuple):
    """The four joints, angles (rad) and rates (rad/s)."""

    q11: float
    q12: float
    q21: float
    q22: float
    dq11: float
    dq12: float
    dq21: float
    dq22: float


def joints_of(state: MechanismState) -> JointMotion:
    """Return the actual joints, on the links' side of the transmissions."""
    return _joints(state.at, state.rate)


def _joints(at: PerBody, rate: PerBody) -> JointMotion:
    return JointMotion(
        at.link1,
        at.distal1 - at.link1,
        at.link2,
        at.distal2 - at.link2,
        rate.link1,
        rate.distal1 - rate.link1,
        rate.link2,
        rate.distal2 - rate.link2,
    )


def motor_seen(state: MechanismState) -> tuple[EncoderReading, EncoderReading]:
    """Return what the motors' encoders saw when they were read, on the rotors' side, before they count."""
    at, rate = state.read_at, state.read_rate
    return EncoderReading(at.rotor1, rate.rotor1), EncoderReading(at.rotor2, rate.rotor2)


def joints_seen(state: MechanismState) -> JointMotion:
    """Return what encoders on all four joints saw: the motors' through their transmissions and errors."""
    exact = _joints(state.read_at, state.read_rate)
    one, two = motor_seen(state)
    return JointMotion(one.angle, exact.q12, two.angle, exact.q22, one.speed, exact.dq12, two.speed, exact.dq22)


class ImuMotion(NamedTuple):
    """Motion of leg 2's tip, which carries the IMU.

    Attributes:
        along, across: acceleration less gravity (m/s^2), along the distal link and across it.
        rate, rate_change: of the distal link (rad/s, rad/s^2).
    """

    along: float
    across: float
    rate: float
    rate_change: float


def imu_motion(mechanism: Mechanism, state: MechanismState, time: float) -> ImuMotion:
    """Return the motion of the IMU's link at a time (s) after sample 0, under the currents up to it."""
    at, rate, leg = state.at, state.rate, mechanism.leg2
    change = accelerations(mechanism, at, rate, state.bristles, state.current1, state.current2, time)
    r_x, r_y = math.cos(at.link2), math.sin(at.link2)
    u_x, u_y = math.cos(at.distal2), math.sin(at.distal2)
    link, distal = rate.link2 * rate.link2, rate.distal2 * rate.distal2
    a_x = -leg.proximal * (r_y * change.link2 + r_x * link) - leg.distal * (u_y * change.distal2 + u_x * distal)
    a_y = leg.proximal * (r_x * change.link2 - r_y * link) + leg.distal * (u_x * change.distal2 - u_y * distal)
    weight = felt_weight(mechanism.shaking, mechanism.weight_x, mechanism.weight_y, time)
    a_x, a_y = a_x - weight.x, a_y - weight.y
    return ImuMotion(u_x * a_x + u_y * a_y, u_x * a_y - u_y * a_x, rate.distal2, change.distal2)


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
        ends.append(chain(leg, q1, theta, dq1, dtheta, 0.0, 0.0, 0.0, 0.0, 0.0))
    elastic += 0.5 * mechanism.platform_friction.stiffness * bristles.platform**2
    stretch = max(0.0, math.hypot(ends[0].x - ends[1].x, ends[0].y - ends[1].y) - mechanism.clearance)
    elastic += 0.5 * mechanism.joint_stiffness * stretch**2
    elastic += stretched_energy(mechanism.cable, 0.5 * (ends[0].x + ends[1].x), 0.5 * (ends[0].y + ends[1].y))
    return Energy(kinetic, elastic)
