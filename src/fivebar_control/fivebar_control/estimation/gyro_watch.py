# SPDX-License-Identifier: Apache-2.0
"""Watch over the gyroscope: whether its readings come, can be used, and change as the robot turns."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.estimation.fault_numbers import (
    GYROSCOPE_EARLY,
    GYROSCOPE_FROZEN,
    GYROSCOPE_LATE,
    GYROSCOPE_MISSING,
    GYROSCOPE_SATURATED,
)
from fivebar_control.safety.stages import NO_FAULT

FEWEST = 5
"""Readings in a row that are the same before a gyroscope is suspected of repeating itself."""

SOONER, SOONER_SHARE = 3, 0.3
"""The same number, and the share of the time without a reading that can be used, where the estimate is inconsistent."""

LEAST_SWING, DEVIATIONS = 0.2, 5.0
"""A gyroscope repeats itself when the predicted rate has changed by this much (rad/s), and by so many standard
deviations of a reading, while it has read the same."""


class GyroHeard(NamedTuple):
    """The readings of the gyroscope so far.

    Attributes:
        unheard: periods since a reading came.
        unused: periods since one came that could be used.
        cause: fault that it would be if none comes that can be used.
        last: last reading (rad/s), NaN before the first.
        same: readings in a row that are the same.
        least, most: of the rates that were predicted for them (rad/s).
    """

    unheard: int
    unused: int
    cause: int
    last: float
    same: int
    least: float
    most: float


def unheard() -> GyroHeard:
    """Return what has been heard before the first sample."""
    return GyroHeard(0, 0, GYROSCOPE_MISSING, math.nan, 0, 0.0, 0.0)


def waited(heard: GyroHeard, periods: int) -> GyroHeard:
    """Return what has been heard so many periods later, without a reading."""
    return GyroHeard(
        heard.unheard + periods,
        heard.unused + periods,
        heard.cause,
        heard.last,
        heard.same,
        heard.least,
        heard.most,
    )


def not_used(heard: GyroHeard, rate: float, early: bool) -> GyroHeard:
    """Return what has been heard after a reading (rad/s) that is not used.

    It is infinite at the end of the range; else its stamp is `early`, ahead of the motors', or too old.
    """
    cause = GYROSCOPE_EARLY if early else GYROSCOPE_LATE
    if math.isinf(rate):
        cause = GYROSCOPE_SATURATED
    return GyroHeard(0, heard.unused, cause, rate, 0, 0.0, 0.0)


def used(heard: GyroHeard, rate: float, predicted: float) -> GyroHeard:
    """Return what has been heard after a reading (rad/s) that is used, where another rate was predicted (rad/s)."""
    if rate == heard.last:
        least, most = min(heard.least, predicted), max(heard.most, predicted)
        return GyroHeard(0, 0, GYROSCOPE_MISSING, rate, heard.same + 1, least, most)
    return GyroHeard(0, 0, GYROSCOPE_MISSING, rate, 1, predicted, predicted)


def gyro_fault(heard: GyroHeard, longest: float, noise: float) -> int:
    """Return the number of the gyroscope's fault, `NO_FAULT` for none.

    Args:
        heard: what has been heard of it.
        longest: periods without a reading that can be used, infinite for no limit.
        noise: standard deviation of a reading (rad/s).
    """
    return _seen(heard, longest, FEWEST, max(LEAST_SWING, DEVIATIONS * noise))


def _seen(heard: GyroHeard, longest: float, fewest: int, swing: float) -> int:
    """Return the fault that is seen after some periods (`longest`), or some equal readings and a predicted swing."""
    if heard.unused > longest:
        return GYROSCOPE_MISSING if heard.unheard > longest else heard.cause
    if heard.same >= fewest and heard.most - heard.least > swing:
        return GYROSCOPE_FROZEN
    return NO_FAULT


def repeats(heard: GyroHeard) -> bool:
    """Return whether it has begun to repeat its reading."""
    return heard.same >= 2


def gyro_cause(heard: GyroHeard, longest: float) -> int:
    """Return the number of the gyroscope's fault that makes an estimate inconsistent, `NO_FAULT` for none.

    Less has to be seen than where nothing contradicts the gyroscope; arguments as for `gyro_fault`.
    """
    return _seen(heard, SOONER_SHARE * longest, SOONER, LEAST_SWING)


def gyro_reason(number: int, heard: GyroHeard, rate_hz: int) -> str:
    """Return the gyroscope's fault in words."""
    since = f"for {heard.unused / rate_hz * 1e3:.0f} ms"
    if number == GYROSCOPE_MISSING:
        return (
            f"no reading of the gyroscope has come {since}: check its power, cable and driver (`imu/data`), or set"
            " ekf.gyro: false where there is none"
        )
    if number == GYROSCOPE_LATE:
        return (
            f"readings of the gyroscope come, but none was young enough {since}: its stamps are more than 20 ms behind"
            " the motors': check its clock (fivebar calibrate finds a constant offset) and its latency"
        )
    if number == GYROSCOPE_EARLY:
        return (
            f"readings of the gyroscope come, but their stamps have been more than 20 ms ahead of the motors' {since}:"
            " check its clock (fivebar calibrate finds a constant offset)"
        )
    if number == GYROSCOPE_SATURATED:
        return f"the gyroscope has been at the end of its range {since}: choose a larger imu.gyro_range, or move slower"
    return (
        f"the gyroscope has read {heard.last:.4f} rad/s {heard.same} times in a row while the link's rate went from"
        f" {heard.least:.2f} to {heard.most:.2f} rad/s: it repeats itself, or is at the end of a range below"
        " imu.gyro_range"
    )
