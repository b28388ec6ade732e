# SPDX-License-Identifier: Apache-2.0
"""Braking after a fault: the motors are damped until the robot is at rest, then there is no torque.

The torque opposes each motor's speed, so it takes energy out of the robot in every posture, on the Type 2 locus too.
Near the locus there is none: there the motors can hardly stop the platform, and what they take from its motion keeps it
from leaving. It brakes only where the measured state is sound; docs/theory.md, section 16.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.laws.torque import ZERO, Torque
from fivebar_control.model.singularity import inverse_condition
from fivebar_control.model.state import State
from fivebar_control.safety.settings import SafetySettings
from fivebar_control.safety.stages import (
    FORBIDDEN_POSTURE,
    NEAR_TYPE_1,
    OUT_OF_WORKSPACE,
    STAGE_NAMES,
    TORQUE_EXCESSIVE,
    TORQUE_UNDEFINED,
    TRACKING_LOST,
    is_in_reach,
    within,
)
from fivebar_description.parameters import FiveBar

BRAKE_TIME = 0.02
"""Time constant (s) with which the brake stops a motor alone; with links and platform it is longer. A shorter one asks
for more torque than most drives have."""

BRAKE_KAPPA = 0.1
"""1/cond(A) below which the brake gives no torque, so that the robot runs out of the Type 2 locus first. With it no
motion of docs/bounds.md that stopped above it ran into Type 1."""

LEAST_SAMPLES = 10
"""Least time constant of the brake in samples: a stronger damping would not be one with a few samples of delay."""

SOUND = (TORQUE_UNDEFINED, TORQUE_EXCESSIVE, OUT_OF_WORKSPACE, FORBIDDEN_POSTURE, NEAR_TYPE_1, TRACKING_LOST)
"""Faults of the stages that leave state and drives sound, by number. After `over_speed` it is not known whether the
motor or its reading is so fast."""

BRAKED_FAULTS = tuple(STAGE_NAMES[number] for number in SOUND)
"""Their names."""


class Brake(NamedTuple):
    """The brake as numbers.

    Attributes:
        samples: longest braking, 0 for none.
        damping1, damping2: of the motors (Nm s/rad).
        torque_limit: largest torque (Nm).
        kappa: 1/cond(A) below which there is no torque.
        rest_speed: joint speed (rad/s) below which the robot is at rest.
    """

    samples: int
    damping1: float
    damping2: float
    torque_limit: float
    kappa: float
    rest_speed: float


class Stopping(NamedTuple):
    """Torque (Nm) of a sample after a fault, and for how many more there may be any."""

    torque: Torque
    left: int


def brake_of(settings: SafetySettings, robot: FiveBar, rate_hz: int) -> Brake:
    """Return the brake of a robot at a sampling rate (Hz)."""
    time_constant = max(BRAKE_TIME, LEAST_SAMPLES / rate_hz)
    return Brake(
        samples=round(settings.brake_duration * rate_hz) if settings.brake else 0,
        damping1=robot.leg1.inertia / time_constant,
        damping2=robot.leg2.inertia / time_constant,
        torque_limit=float(settings.torque_limit),
        kappa=BRAKE_KAPPA,
        rest_speed=float(settings.rest_speed),
    )


def braking_after(brake: Brake, fault: int) -> int:
    """Return for how many samples the robot may be braked after a fault of the stages, by its number."""
    return brake.samples if fault in SOUND else 0


def stopping(brake: Brake, robot: FiveBar, state: State, left: int) -> Stopping:
    """Return the torque of a sample after a fault.

    Args:
        brake: settings.
        robot: nominal robot of the controllers.
        state: measured or estimated state.
        left: for how many samples the robot may still be braked; 0 where state or drives are not sound.
    """
    if left <= 0 or not is_sound(robot, state) or is_at_rest(state, brake.rest_speed):
        return Stopping(ZERO, 0)
    if inverse_condition(state) < brake.kappa:
        return Stopping(ZERO, left - 1)
    damping = Torque(-brake.damping1 * state.leg1.dq1, -brake.damping2 * state.leg2.dq1)
    return Stopping(within(damping, ZERO, brake.torque_limit), left - 1)


def is_sound(robot: FiveBar, state: State) -> bool:
    """Return whether a state is known and the joints do not contradict each other."""
    return math.isfinite(joint_speed(state)) and is_in_reach(robot, state)


def is_at_rest(state: State, rest_speed: float) -> bool:
    """Return whether all links turn below a speed (rad/s): on the locus the motors rest while the platform moves."""
    return joint_speed(state) < rest_speed


def joint_speed(state: State) -> float:
    """Return the root of the sum of squares of the links' speeds (rad/s), NaN where one is not known."""
    leg1, leg2 = state.leg1, state.leg2
    return math.sqrt(leg1.dq1**2 + leg1.dtheta**2 + leg2.dq1**2 + leg2.dtheta**2)
