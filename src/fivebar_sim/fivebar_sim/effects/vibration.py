"""A table that vibrates: the robot's base moves with it along a direction of the robot's plane."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np

from fivebar_description.settings import Setting
from fivebar_sim.effects.platform_joint import Force

STREAM = 9
"""Of the random number that is the phase of the vibration."""


class Vibration(NamedTuple):
    """A base that moves to and fro along a line, by a sine whose phase follows the seed.

    Positions, speeds and errors are those against the base. An accelerometer feels the motion; a gyroscope does not.
    """

    amplitude: Annotated[
        float,
        Setting(
            "Amplitude of the base's motion; typical: 1e-5 on a workbench, 5e-5 on a light table.",
            "m",
            at_least=0.0,
            at_most=0.1,
        ),
    ] = 0.0
    frequency: Annotated[
        float, Setting("Its frequency; typical: 10 to 25 for a table.", "Hz", at_least=0.1, at_most=500.0)
    ] = 15.0
    heading: Annotated[
        float, Setting("Its direction, from the x axis.", "rad", at_least=-2.0 * math.pi, at_most=2.0 * math.pi)
    ] = 0.0


class Shaking(NamedTuple):
    """A vibration as numbers: amplitude of the base's acceleration (m/s^2), pulsation (rad/s) and phase (rad)."""

    x: float
    y: float
    pulsation: float
    phase: float


STILL = Shaking(0.0, 0.0, 0.0, 0.0)


def shaking_of(vibration: Vibration, seed: int) -> Shaking:
    """Return the vibration of a plant with a seed as numbers."""
    if vibration.amplitude == 0.0:
        return STILL
    pulsation = 2.0 * math.pi * vibration.frequency
    size = vibration.amplitude * pulsation**2
    phase = float(np.random.default_rng([seed, STREAM]).uniform(0.0, 2.0 * math.pi))
    return Shaking(size * math.cos(vibration.heading), size * math.sin(vibration.heading), pulsation, phase)


def felt_weight(shaking: Shaking, weight_x: float, weight_y: float, time: float) -> Force:
    """Return what acts on every mass (N/kg) at a time (s): the weight in the plane, less the base's acceleration."""
    if shaking.pulsation == 0.0:
        return Force(weight_x, weight_y)
    # the base is at a sine of its amplitude, so that it accelerates against where it is
    wave = math.sin(shaking.pulsation * time + shaking.phase)
    return Force(weight_x + shaking.x * wave, weight_y + shaking.y * wave)
