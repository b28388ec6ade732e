# SPDX-License-Identifier: Apache-2.0
"""A sensor from outside the tree: a linear encoder between a point of the base and the platform."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_control.model.state import WorkingMode
from fivebar_description.extra_sensor import ExpectedReading, ExtraSensor
from fivebar_description.parameters import FiveBar
from fivebar_description.sensors import Latency, LostReadings, ReadingRate
from fivebar_description.settings import Setting


class LinearEncoderSettings(NamedTuple):
    """Where it is fixed to the base, and how exactly it reads."""

    x: Annotated[float, Setting("x of its joint on the base.", "m", at_least=-1.0, at_most=1.0)] = 0.1
    y: Annotated[float, Setting("y of its joint on the base.", "m", at_least=-1.0, at_most=1.0)] = 0.3
    step: Annotated[float, Setting("Length of a count.", "m", at_least=1e-9, at_most=1e-3)] = 1e-6
    noise: Annotated[float, Setting("Standard deviation of its noise.", "m", at_least=0.0, at_most=1e-2)] = 2e-6
    placed_within: Annotated[
        float, Setting("Tolerance of that joint's place, along the encoder.", "m", at_least=0.0, at_most=1e-2)
    ] = 2e-5
    rate_hz: ReadingRate = 0
    latency: Latency = 0.0
    lost: LostReadings = 0.0


def expected_length(
    settings: LinearEncoderSettings, robot: FiveBar, mode: WorkingMode, x: float, y: float, vx: float, vy: float
) -> ExpectedReading:
    """Return the length (m) that is expected at a platform, and its derivatives."""
    across_x, across_y = x - settings.x, y - settings.y
    length = math.hypot(across_x, across_y)
    return ExpectedReading(length, across_x / length, across_y / length, 0.0, 0.0)


def read_length(
    settings: LinearEncoderSettings,
    robot: FiveBar,
    q11: float,
    q12: float,
    q21: float,
    q22: float,
    noise: float,
) -> float:
    """Return the length (m) that the simulated encoder reads, along leg 1 to the platform."""
    leg = robot.leg1
    x = leg.base_x + leg.proximal * math.cos(q11) + leg.distal * math.cos(q11 + q12)
    y = leg.proximal * math.sin(q11) + leg.distal * math.sin(q11 + q12)
    length = math.hypot(x - settings.x, y - settings.y) + settings.noise * noise
    return math.floor(length / settings.step) * settings.step


def deviation(settings: LinearEncoderSettings) -> float:
    """Return the standard deviation (m) of a reading, the place of its joint included."""
    spread = math.hypot(settings.step, settings.placed_within) / math.sqrt(3.0)
    return math.hypot(settings.noise, spread)


SENSOR = ExtraSensor("linear encoder", LinearEncoderSettings, expected_length, read_length, deviation)

NO_SENSOR = 3.0
