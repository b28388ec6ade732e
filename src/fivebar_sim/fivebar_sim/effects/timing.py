# SPDX-License-Identifier: Apache-2.0
"""Commands that take effect later than their sample or are lost, and encoders that are read before their stamp.

Delays are a part of a sample; whole samples are `delay_samples`. The jitter of a sample follows from seed and number,
so that any sample can be asked for in any order.
"""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from fivebar_description.settings import Setting
from fivebar_description.strict_yaml import InputError

JITTER_STREAM, LOSS_STREAM = 4, 3
"""Streams of the random numbers that make the jitter, and that choose the lost commands."""

RANGE = 2**31
MIXING = 73244475
"""An odd number whose products with numbers below the range fit into 63 bits."""

MOMENT = 1e-9
"""Time (s) by which a sample may be before a moment and count as at it, for rounding."""


def moment_setting(description: str) -> Setting:
    """Return the setting of when a fault begins, from sample 0, or of how long it lasts."""
    return Setting(description, "s", at_least=0.0, at_most=1e6)


def _time(description: str) -> Setting:
    return Setting(description, "s", at_least=0.0, at_most=1.0)


class Timing(NamedTuple):
    """Late commands and old readings, as parts of a sample. With its jitter each is at most a sample."""

    command_delay: Annotated[
        float,
        _time(
            "How much later than its sample a command takes effect; typical: 1e-4 to 5e-4 where the bus has its turn."
        ),
    ] = 0.0
    command_jitter: Annotated[
        float, _time("Largest further delay of a command, uniformly drawn for each; typical: 1e-4.")
    ] = 0.0
    reading_age: Annotated[
        float, _time("How long before its stamp an encoder is read; typical: 1e-4 to 5e-4 for filters and transfer.")
    ] = 0.0
    reading_jitter: Annotated[
        float, _time("Largest further age of a reading, uniformly drawn for each; typical: 1e-4.")
    ] = 0.0


class Delays(NamedTuple):
    """The settings as numbers (s), and the keys of both jitters."""

    command: float
    command_jitter: float
    reading: float
    reading_jitter: float
    command_key: int
    reading_key: int


class Moments(NamedTuple):
    """Times (s) after a sample: when its command takes effect, and when the encoders are read for the next one."""

    obeyed: float
    read: float


def delays_of(timing: Timing, seed: int, period: float) -> Delays:
    """Return the delays of a plant with samples every `period` (s).

    Raises:
        InputError: one is longer than a sample.
    """
    for name, longest in (
        ("command_delay", timing.command_delay + timing.command_jitter),
        ("reading_age", timing.reading_age + timing.reading_jitter),
    ):
        if longest > period:
            raise InputError(
                f"plant.timing.{name}: {longest:g} s with its jitter: expected at most a sample, {period:g} s; whole"
                " samples are plant.delay_samples"
            )
    keys = np.random.default_rng([seed, JITTER_STREAM]).integers(0, RANGE, 2).tolist()
    command, command_jitter, age, age_jitter = map(float, timing)
    return Delays(command, command_jitter, age, age_jitter, *keys)


def drawn(key: int, number: int) -> float:
    """Return the random number of a sample, from 0 to below 1."""
    mixed = (key + number * MIXING) % RANGE
    for _ in range(3):
        mixed = (mixed ^ (mixed >> 16)) * MIXING % RANGE
    return (mixed ^ (mixed >> 16)) / RANGE


def moments_after(delays: Delays, number: int, period: float) -> Moments:
    """Return the moments of the events between a sample and the next one, `period` (s) later."""
    obeyed, age = delays.command, delays.reading
    if delays.command_jitter > 0.0:
        obeyed += delays.command_jitter * drawn(delays.command_key, number)
    if delays.reading_jitter > 0.0:
        age += delays.reading_jitter * drawn(delays.reading_key, number + 1)
    return Moments(min(obeyed, period), max(0.0, period - age))


class BusEffects(NamedTuple):
    """Lost commands: each holds the one before.

    A command that is late by a sample is lost, as the next one overtakes it, and so is that of a sample whose
    measurement is lost or late.
    """

    lost_commands: Annotated[
        int, Setting("How many commands are lost, chosen by the seed; typical: 0 to 3.", at_least=0, at_most=10_000)
    ] = 0
    lost_from: Annotated[
        float, Setting("Begin of the time in which they are lost, from sample 0.", "s", at_least=0.0, at_most=1e4)
    ] = 0.0
    lost_within: Annotated[float, Setting("Length of that time.", "s", above=0.0, at_most=100.0)] = 1.0


def lost_commands(bus: BusEffects, seed: int, rate_hz: int) -> tuple[int, ...]:
    """Return the samples whose commands are lost, in order."""
    first = round(bus.lost_from * rate_hz)
    samples = max(1, round(bus.lost_within * rate_hz))
    chosen = np.random.default_rng([seed, LOSS_STREAM]).permutation(samples)[: bus.lost_commands]
    return tuple(sorted(first + number for number in chosen.tolist()))
