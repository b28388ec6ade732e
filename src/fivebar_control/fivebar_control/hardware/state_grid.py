# SPDX-License-Identifier: Apache-2.0
"""Puts joint states, which come with stamps and at a rate of their own, on the grid of a run's sampling period.

A sample is the state at its instant on the grid, which the first state begins. States that are about as frequent as
samples are moved to that instant by a part of a period at most; where they are more frequent, the instant lies
between two of them or near one.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_description.interface import NANOSECONDS

TOLERANCE = 0.02
"""Part of the states' period by which a stamp may miss an instant while the state is taken as it is: what a clock is
read late by says nothing about the angle."""

TRACKING = 0.005
"""Part of the deviation by which the grid follows states that are as frequent as samples or a whole number of times as
frequent: two clocks differ, and drift."""

WHOLE = 0.02
"""Deviation from a whole number up to which states count as so many times as frequent as samples."""

SLOWEST = 1.05
"""Longest period of the states, in sampling periods."""


class JointStates(NamedTuple):
    """Both motors as one message has them, with NaN for a velocity or torque that it has not.

    Attributes:
        positions, velocities, efforts: of both motors.
    """

    positions: tuple[float, float]
    velocities: tuple[float, float]
    efforts: tuple[float, float]


class GridSample(NamedTuple):
    """The state at an instant of the grid, and how many periods after the last sample that is."""

    periods: int
    states: JointStates


class StateGrid:
    """The samples among states. Stamps are integer nanoseconds of whatever clock the states have."""

    def __init__(self, period: float, states_period: float) -> None:
        """Wait for the first state.

        Args:
            period: the sampling period (s).
            states_period: time (s) between two states, at most `SLOWEST` sampling periods.
        """
        self._period = period * NANOSECONDS
        self._states_period = states_period * NANOSECONDS
        ratio = self._period / self._states_period
        self._follows = abs(ratio - max(1.0, round(ratio))) <= max(WHOLE * ratio, SLOWEST - 1.0)
        self._instant = math.nan
        self._last: tuple[int, JointStates] | None = None
        self._sampled: tuple[float, tuple[float, float]] | None = None
        self.lost = 0
        """Samples without a state near enough, so far."""
        self.old = 0
        """States that were no newer than the one before, so far."""

    @property
    def is_last(self) -> bool:
        """Whether the next state is to be a sample, so that a torque that is published now acts from that sample on."""
        if self._last is None:
            return True
        return self._last[0] + 1.5 * self._states_period - self._instant >= self._period

    def take(self, stamp: int, states: JointStates) -> GridSample | None:
        """Take a state; return the sample that it completes, if it does."""
        last, self._last = self._last, (stamp, states)
        if last is None:
            self._instant = float(stamp)
            return self._sample(1, states)
        if stamp <= last[0]:
            self.old += 1
            self._last = last
            return None
        slack = 0.5 * self._states_period
        periods = math.floor((stamp + slack - self._instant) / self._period)
        if periods < 1:
            return None
        self.lost += periods - 1
        self._instant += periods * self._period
        deviation = stamp - self._instant
        if abs(deviation) > TOLERANCE * self._states_period:
            states = _moved(states, last, stamp, -deviation)
        if self._follows:
            self._instant += TRACKING * deviation
        return self._sample(periods, states)

    def _sample(self, periods: int, states: JointStates) -> GridSample:
        """Return a sample, whose velocities are those between the last two samples where the state has none."""
        before, self._sampled = self._sampled, (self._instant, states.positions)
        velocities = tuple(
            velocity if math.isfinite(velocity) else self._speed(number, before)
            for number, velocity in enumerate(states.velocities)
        )
        return GridSample(periods, states._replace(velocities=(velocities[0], velocities[1])))

    def _speed(self, number: int, before: tuple[float, tuple[float, float]] | None) -> float:
        assert self._sampled is not None
        if before is None or self._sampled[0] <= before[0]:
            return 0.0
        turned = self._sampled[1][number] - before[1][number]
        return turned * NANOSECONDS / (self._sampled[0] - before[0])


def _moved(states: JointStates, last: tuple[int, JointStates], stamp: int, shift: float) -> JointStates:
    """Return states at another time (ns after their stamp), on the line through them and those before."""
    before, earlier = last[1], stamp - last[0]

    def at(now: tuple[float, float], then: tuple[float, float]) -> tuple[float, float]:
        first, second = (present + (present - past) * shift / earlier for present, past in zip(now, then, strict=True))
        return first, second

    return states._replace(
        positions=at(states.positions, before.positions), velocities=at(states.velocities, before.velocities)
    )
