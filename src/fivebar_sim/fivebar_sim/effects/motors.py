# SPDX-License-Identifier: Apache-2.0
"""Torque of a motor for the torque that is asked of it: torque constant, current loop, ripple and cogging."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting


def _constant(number: int) -> Setting:
    return Setting(
        f"Relative error of motor {number}'s torque constant, actual over assumed less 1; typical: 0.05.",
        at_least=-0.9,
        at_most=10.0,
    )


def _periods(what: str, typical: int) -> Setting:
    return Setting(f"Periods of {what} in a turn of the joint; typical: {typical}.", at_least=0.0, at_most=1e5)


class MotorEffects(NamedTuple):
    """Errors of the motors between set and actual torque. The phases of ripple and cogging follow the seed."""

    constant_1: Annotated[float, _constant(1)] = 0.0
    constant_2: Annotated[float, _constant(2)] = 0.0
    ripple: Annotated[
        float, Setting("Torque ripple as a share of the torque; typical: 0.01 to 0.05.", at_least=0.0, at_most=1.0)
    ] = 0.0
    ripple_periods: Annotated[float, _periods("the ripple, six per pole pair and turn of the motor", 42)] = 42.0
    cogging: Annotated[
        float,
        Setting(
            "Amplitude of the cogging torque; typical: 1 to 3 % of rated torque.", "Nm", at_least=0.0, at_most=10.0
        ),
    ] = 0.0
    cogging_periods: Annotated[
        float, _periods("cogging, the least common multiple of slots and poles a turn of the motor", 84)
    ] = 84.0
    current_loop_hz: Annotated[
        float,
        Setting(
            "Bandwidth of the current loop, a first-order lag, 0 for none; typical: 500 to 2000.",
            "Hz",
            at_least=0.0,
            at_most=1e5,
        ),
    ] = 0.0


class Motor(NamedTuple):
    """One motor as numbers: torque over asked torque, ripple (share), cogging (Nm); their periods and phases (rad)."""

    gain: float
    ripple: float
    ripple_periods: float
    ripple_phase: float
    cogging: float
    cogging_periods: float
    cogging_phase: float


def motor_of(effects: MotorEffects, error: float, ripple_phase: float, cogging_phase: float) -> Motor:
    """Return a motor with an error of its torque constant and phases (rad)."""
    return Motor(
        1.0 + error,
        effects.ripple,
        effects.ripple_periods,
        ripple_phase,
        effects.cogging,
        effects.cogging_periods,
        cogging_phase,
    )


def current_after(before: float, wanted: float, bandwidth: float, time: float) -> float:
    """Return the current as a torque (Nm) that a loop (rad/s, 0 for an ideal one) has reached after a time (s)."""
    return wanted if bandwidth == 0.0 else wanted + (before - wanted) * math.exp(-bandwidth * time)


def motor_torque(motor: Motor, current: float, angle: float) -> float:
    """Return the torque (Nm) of a current, given as the torque that it should make, at an angle (rad)."""
    torque = motor.gain * current
    if motor.ripple > 0.0:
        torque *= 1.0 + motor.ripple * math.sin(motor.ripple_periods * angle + motor.ripple_phase)
    if motor.cogging > 0.0:
        torque += motor.cogging * math.sin(motor.cogging_periods * angle + motor.cogging_phase)
    return torque
