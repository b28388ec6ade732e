# SPDX-License-Identifier: Apache-2.0
"""The sensors' view of the robot with effects."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_sim.effects.body_dynamics import accelerations
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
    motor1, motor2 = motor_seen(state)
    return JointMotion(
        motor1.angle, exact.q12, motor2.angle, exact.q22, motor1.speed, exact.dq12, motor2.speed, exact.dq22
    )


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
