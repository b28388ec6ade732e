# SPDX-License-Identifier: Apache-2.0
"""Errors of the motors' encoders: zeros, eccentricity and interpolation, and faults: slips and readings that freeze."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting
from fivebar_description.strict_yaml import InputError
from fivebar_sim.effects.timing import MOMENT, moment_setting


def _zero(number: int) -> Setting:
    return Setting(
        f"Reading of motor {number}'s encoder where the angle is 0; typical: 2e-4 (0.01 deg) calibrated, 3e-3 by eye.",
        "rad",
        at_least=-math.pi,
        at_most=math.pi,
    )


def _slip(number: int) -> Setting:
    return Setting(
        f"Counts by which motor {number}'s encoder slips at `slip_time`; typical: 5 to 200 for a loose coupling or lost"
        " edges.",
        at_least=-(10**6),
        at_most=10**6,
    )


class EncoderErrors(NamedTuple):
    """How the motors' encoders are off, besides counting. The phases of eccentricity and interpolation follow the seed.

    Slips and frozen readings begin with the first sample at or after their time; sample 0 is always sound.
    """

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
    interpolation: Annotated[
        float,
        Setting(
            "Amplitude of the error within each line of the disc; typical: 1e-5 to 1e-4.",
            "rad",
            at_least=0.0,
            at_most=0.01,
        ),
    ] = 0.0
    lines: Annotated[
        int, Setting("Lines of the disc, in each of which that error repeats.", at_least=1, at_most=10**6)
    ] = 1000
    slip_1: Annotated[int, _slip(1)] = 0
    slip_2: Annotated[int, _slip(2)] = 0
    slip_time: Annotated[float, moment_setting("When they slip, from sample 0.")] = 0.0
    frozen_motor: Annotated[
        int, Setting("Motor, 1 or 2, whose encoder repeats its reading for a time, 0 for none.", at_least=0, at_most=2)
    ] = 0
    frozen_from: Annotated[float, moment_setting("Begin of that time, from sample 0.")] = 0.0
    frozen_length: Annotated[float, moment_setting("Length of that time.")] = 1e6


class EncoderDisc(NamedTuple):
    """One encoder as numbers.

    Attributes:
        zero: reading where the angle is 0 (rad).
        amplitude, phase: of the error once a turn (rad).
        interpolation, lines, line_phase: amplitude (rad) of the error within each line, lines, and its phase (rad).
        slip, slipped: by how much it slips (rad), and when (s).
        frozen, thawed: when its reading freezes, and when no longer (s).
    """

    zero: float
    amplitude: float
    phase: float
    interpolation: float = 0.0
    lines: float = 1.0
    line_phase: float = 0.0
    slip: float = 0.0
    slipped: float = math.inf
    frozen: float = math.inf
    thawed: float = math.inf


STEEPEST = 0.5
"""Largest slope of the error over the angle: a steeper disc would not tell the angle."""


def disc_of(errors: EncoderErrors, motor: int, counts: int, phase: float, line_phase: float) -> EncoderDisc:
    """Return motor 1's or 2's encoder as numbers.

    Args:
        errors: of both.
        motor: 1 or 2.
        counts: per revolution, 0 for exact encoders.
        phase, line_phase: of its periodic errors (rad).

    Raises:
        InputError: an exact encoder is to slip by counts, or the error is too steep.
    """
    slip = errors.slip_1 if motor == 1 else errors.slip_2
    if slip != 0 and counts == 0:
        raise InputError(
            f"plant.encoders.slip_{motor}: {slip} counts of an exact encoder: expected plant.encoder_counts too,"
            " such as 20000"
        )
    slope = errors.interpolation * errors.lines
    if slope > STEEPEST:
        raise InputError(
            f"plant.encoders.interpolation: {errors.interpolation:g} rad with {errors.lines} lines: expected at most"
            f" {STEEPEST / errors.lines:g} rad, beyond which the disc does not tell the angle"
        )
    frozen, thawed = math.inf, math.inf
    if errors.frozen_motor == motor:
        frozen = errors.frozen_from - MOMENT
        thawed = frozen + errors.frozen_length
    return EncoderDisc(
        float(errors.zero_1 if motor == 1 else errors.zero_2),
        float(errors.eccentricity),
        phase,
        float(errors.interpolation),
        float(errors.lines),
        line_phase,
        2.0 * math.pi * slip / counts if slip != 0 else 0.0,
        errors.slip_time - MOMENT if slip != 0 else math.inf,
        frozen,
        thawed,
    )


class EncoderReading(NamedTuple):
    """Angle (rad) and speed (rad/s) as an encoder sees them, before it counts."""

    angle: float
    speed: float


def seen(disc: EncoderDisc, angle: float, speed: float) -> EncoderReading:
    """Return what a sound encoder sees of an angle (rad) and speed (rad/s)."""
    if disc.amplitude == 0.0 and disc.interpolation == 0.0:
        return EncoderReading(angle + disc.zero, speed)
    turned, line = angle + disc.phase, disc.lines * angle + disc.line_phase
    error = disc.amplitude * math.sin(turned) + disc.interpolation * math.sin(line)
    slope = disc.amplitude * math.cos(turned) + disc.interpolation * disc.lines * math.cos(line)
    return EncoderReading(angle + disc.zero + error, speed * (1.0 + slope))


def read_at(disc: EncoderDisc, angle: float, speed: float, time: float, before: EncoderReading) -> EncoderReading:
    """Return what an encoder with its faults sees of an angle (rad) and speed (rad/s).

    Args:
        disc: of the encoder.
        angle, speed: of the motor (rad, rad/s).
        time: of the sample (s).
        before: what it saw for the sample before.
    """
    if disc.frozen <= time < disc.thawed:
        return EncoderReading(before.angle, 0.0)
    reading = seen(disc, angle, speed)
    return EncoderReading(reading.angle + disc.slip, reading.speed) if time >= disc.slipped else reading


def angle_seen_as(disc: EncoderDisc, reading: float) -> float:
    """Return the angle (rad) that a sound encoder sees as a reading (rad)."""
    angle = reading - disc.zero
    for _ in range(60):
        # contracts by the slope, which is at most 0.6
        error = disc.amplitude * math.sin(angle + disc.phase)
        error += disc.interpolation * math.sin(disc.lines * angle + disc.line_phase)
        angle = reading - disc.zero - error
    return angle
