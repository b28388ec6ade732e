# SPDX-License-Identifier: Apache-2.0
"""The state of the robot with effects: absolute angles of its bodies, bristles and currents."""

from __future__ import annotations

from typing import NamedTuple


class PerBody(NamedTuple):
    """A value (rad, rad/s or rad/s^2) for each body: both rotors, proximal links and distal links, absolute angles."""

    link1: float
    distal1: float
    link2: float
    distal2: float
    rotor1: float
    rotor2: float


ZERO = PerBody(0.0, 0.0, 0.0, 0.0, 0.0, 0.0)


class Bristles(NamedTuple):
    """Deflections (rad) of the bristles in the five joints with friction, and the heat (J) in both motors."""

    motor1: float
    motor2: float
    elbow1: float
    elbow2: float
    platform: float
    heat1: float
    heat2: float


class MechanismState(NamedTuple):
    """The robot at a sample, or between two.

    Attributes:
        at, rate: angles and rates.
        bristles: their deflections, and the motors' heat.
        current1, current2: currents, as torques (Nm), at the last sample or change of torque.
        wanted1, wanted2: torques (Nm) that the drives are set to.
        read_at, read_rate: angles and rates when the encoders were read last, those of the rotors as the motors'
            encoders saw them.
    """

    at: PerBody
    rate: PerBody
    bristles: Bristles
    current1: float
    current2: float
    wanted1: float
    wanted2: float
    read_at: PerBody
    read_rate: PerBody


class Moved(NamedTuple):
    """A later state, and the gap (m) of the loop on the way; infinite where the motion cannot be simulated."""

    state: MechanismState
    gap: float
