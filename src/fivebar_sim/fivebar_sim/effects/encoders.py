"""Errors of the motors' encoders that are the same in every turn: zeros and eccentricity."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting


def _zero(number: int) -> Setting:
    return Setting(
        f"Reading of motor {number}'s encoder where the angle is 0; typical: 2e-4 (0.01 deg) calibrated, 3e-3 by eye.",
        "rad",
        at_least=-math.pi,
        at_most=math.pi,
    )


class EncoderErrors(NamedTuple):
    """How the motors' encoders are off, besides counting. The phases of the eccentricity follow the seed."""

    zero_1: Annotated[float, _zero(1)] = 0.0
    zero_2: Annotated[float, _zero(2)] = 0.0
    eccentricity: Annotated[
        float,
        Setting(
            "Amplitude of the error once a turn: eccentricity over the disc's radius; typical: 1e-4 to 1e-3.",
            "rad",
            at_least=0.0,
            at_most=0.1,
        ),
    ] = 0.0


class EncoderDisc(NamedTuple):
    """One encoder as numbers: zero, amplitude of the error once a turn and its phase (rad)."""

    zero: float
    amplitude: float
    phase: float


class EncoderReading(NamedTuple):
    """Angle (rad) and speed (rad/s) as an encoder sees them, before it counts."""

    angle: float
    speed: float


def seen(disc: EncoderDisc, angle: float, speed: float) -> EncoderReading:
    """Return what an encoder sees of an angle (rad) and speed (rad/s)."""
    if disc.amplitude == 0.0:
        return EncoderReading(angle + disc.zero, speed)
    turned = angle + disc.phase
    return EncoderReading(
        angle + disc.zero + disc.amplitude * math.sin(turned), speed * (1.0 + disc.amplitude * math.cos(turned))
    )


def angle_seen_as(disc: EncoderDisc, reading: float) -> float:
    """Return the angle (rad) that an encoder sees as a reading (rad)."""
    angle = reading - disc.zero
    for _ in range(20):
        # contracts by the amplitude, which is at most 0.1
        angle = reading - disc.zero - disc.amplitude * math.sin(angle + disc.phase)
    return angle
