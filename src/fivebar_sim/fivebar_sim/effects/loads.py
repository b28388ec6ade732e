# SPDX-License-Identifier: Apache-2.0
"""Loads from outside: weight on a tilted base, a push against the platform, and a table that vibrates."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

import numpy as np

from fivebar_description.imu import STANDARD_GRAVITY
from fivebar_description.parameters import FiveBar, has_external_force
from fivebar_description.settings import Setting, as_numbers
from fivebar_sim.effects.platform_joint import Force

PLANE, LOCUS = "plane", "locus"

VIBRATION_STREAM = 9
"""Stream of the random number that is the phase of the vibration."""


class Tilt(NamedTuple):
    """A base that is not level, so that a part of the weight acts in the robot's plane.

    The controllers do not know it. A tilt that they know is in the robot's file (`forces`), and adds to this one.
    """

    angle: Annotated[
        float,
        Setting(
            "Angle between the robot's plane and the horizontal; typical: 0.02 on a table.",
            "rad",
            at_least=0.0,
            at_most=math.pi / 2,
        ),
    ] = 0.0
    heading: Annotated[
        float, Setting("Direction downhill, from the x axis.", "rad", at_least=-2.0 * math.pi, at_most=2.0 * math.pi)
    ] = 0.0
    leg_moment: Annotated[
        float,
        Setting(
            "First mass moment of each proximal link about its motor axis, with the distal link's mass at the elbow, 0"
            " where only the platform weighs; typical: 0.02 to 0.05. It adds to that of the robot's file.",
            "kg m",
            at_least=0.0,
            at_most=10.0,
        ),
    ] = 0.0


class Push(NamedTuple):
    """A constant force on the platform for some time."""

    force: Annotated[
        float, Setting("The force; typical: 0.5 to 2 for a cable that drags.", "N", at_least=0.0, at_most=1e4)
    ] = 0.0
    heading: Annotated[
        float, Setting("Its direction, from that of `along`.", "rad", at_least=-2.0 * math.pi, at_most=2.0 * math.pi)
    ] = 0.0
    along: Annotated[
        str,
        Setting(
            "Where headings count from: the x axis of the plane, or the direction across the distal link of leg 1, on"
            " the Type 2 locus the one that no motor torque accelerates.",
            choices=(PLANE, LOCUS),
        ),
    ] = PLANE
    start: Annotated[float, Setting("When it begins, from sample 0.", "s", at_least=0.0, at_most=1e6)] = 0.0
    length: Annotated[float, Setting("How long it lasts; typical: 0.05.", "s", at_least=0.0, at_most=1e6)] = 0.05


def weight_on(robot: FiveBar, tilt: Tilt) -> Force:
    """Return the part of gravity in the plane of a robot (N/kg): what is known of it, and the tilt that is not."""
    along = STANDARD_GRAVITY * math.sin(tilt.angle)
    return Force(robot.gravity_x + along * math.cos(tilt.heading), robot.gravity_y + along * math.sin(tilt.heading))


def tilt_angle(robot: FiveBar, tilt: Tilt) -> float:
    """Return the angle (rad) between a robot's plane and the horizontal."""
    if not has_external_force(robot):
        return tilt.angle
    weight = weight_on(robot, tilt)
    return math.asin(min(1.0, math.hypot(weight.x, weight.y) / STANDARD_GRAVITY))


def held(x: float, y: float) -> Push:
    """Return a force (N) that never ends, as numbers."""
    return as_numbers(Push(math.hypot(x, y), math.atan2(y, x), PLANE, 0.0, math.inf))


def push_at(push: Push, time: float, distal_x: float, distal_y: float) -> Force:
    """Return the force (N) at a time (s), with leg 1's distal link along the given unit vector; `push` as numbers."""
    if push.force == 0.0 or time < push.start or time >= push.start + push.length:
        return Force(0.0, 0.0)
    along, across = push.force * math.cos(push.heading), push.force * math.sin(push.heading)
    if push.along:
        # from the direction (-u_y, u_x) across the link
        return Force(-distal_y * along - distal_x * across, distal_x * along - distal_y * across)
    return Force(along, across)


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
    phase = float(np.random.default_rng([seed, VIBRATION_STREAM]).uniform(0.0, 2.0 * math.pi))
    return Shaking(size * math.cos(vibration.heading), size * math.sin(vibration.heading), pulsation, phase)


def felt_weight(shaking: Shaking, weight_x: float, weight_y: float, time: float) -> Force:
    """Return what acts on every mass (N/kg) at a time (s): the weight in the plane, less the base's acceleration."""
    if shaking.pulsation == 0.0:
        return Force(weight_x, weight_y)
    # the base is at a sine of its amplitude, so that it accelerates against where it is
    wave = math.sin(shaking.pulsation * time + shaking.phase)
    return Force(weight_x + shaking.x * wave, weight_y + shaking.y * wave)
