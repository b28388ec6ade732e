"""Commands that do not reach the drives in time."""

from __future__ import annotations

from typing import Annotated, NamedTuple

import numpy as np

from fivebar_description.settings import Setting

STREAM = 3
"""Of the random numbers that choose the lost commands."""


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
    chosen = np.random.default_rng([seed, STREAM]).permutation(samples)[: bus.lost_commands]
    return tuple(sorted(first + number for number in chosen.tolist()))
