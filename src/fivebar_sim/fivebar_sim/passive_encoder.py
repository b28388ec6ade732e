"""The simulated encoder on a passive joint: zero, eccentricity and counts; numba compiles `passive_reading`."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fivebar_description.passive_encoder import PassiveEncoder
from fivebar_sim.effects.encoders import EncoderDisc, seen
from fivebar_sim.sensors import counted

STREAM = 5
"""Stream of the random number that is the phase of the eccentricity."""


class PassiveNumbers(NamedTuple):
    """The encoder as numbers: its disc, and the angle of a count (rad), 0 for an exact one."""

    disc: EncoderDisc
    resolution: float


def passive_numbers(settings: PassiveEncoder, seed: int) -> PassiveNumbers:
    """Return the numbers of an encoder; the seed is that of its phase."""
    phase = float(np.random.default_rng([seed, STREAM]).uniform(0.0, 2.0 * math.pi))
    resolution = 2.0 * math.pi / settings.counts if settings.counts else 0.0
    return PassiveNumbers(EncoderDisc(float(settings.zero), float(settings.eccentricity), phase), resolution)


def passive_reading(numbers: PassiveNumbers, angle: float) -> float:
    """Return the reading (rad) of an angle (rad)."""
    reading = seen(numbers.disc, angle, 0.0).angle
    return counted(reading, numbers.resolution) if numbers.resolution > 0.0 else reading
