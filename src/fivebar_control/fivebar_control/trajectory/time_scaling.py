# SPDX-License-Identifier: Apache-2.0
"""Time laws: how a motion passes from 0 to 1 of its way between 0 and 1 of its duration.

Rest to rest these are polynomials of fifth order (4.3 to 4.6), or of seventh order, which starts without a jerk.
"""

from __future__ import annotations

from collections.abc import Callable

from fivebar_control.root_search import zero_between

TimeLaw = Callable[[float], tuple[float, float, float]]
"""From the fraction u of the duration to the fraction s of the way and its two derivatives by u."""


def progress(law: TimeLaw, t: float, duration: float) -> tuple[float, float, float]:
    """Return the share of the way at a time t (s) of a motion, with its two derivatives by time (1/s, 1/s^2)."""
    s, ds, dds = law(t / duration)
    return s, ds / duration, dds / (duration * duration)


def time_fraction(law: TimeLaw, s: float) -> float:
    """Return the fraction of the duration after which a motion has gone the fraction s of its way."""
    return zero_between(lambda u: law(u)[0] - s, 0.0, 1.0, 1e-15)


def rest_to_rest(u: float) -> tuple[float, float, float]:
    """Return s, ds/du, d2s/du2 of s = 10 u^3 - 15 u^4 + 6 u^5.

    It goes from 0 to 1 with zero speed and acceleration at both ends; outside [0, 1] the motion rests.
    """
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    if u >= 1.0:
        return 1.0, 0.0, 0.0
    return (
        u * u * u * (10.0 + u * (6.0 * u - 15.0)),
        30.0 * u * u * (1.0 - u) * (1.0 - u),
        60.0 * u * (1.0 - u) * (1.0 - 2.0 * u),
    )


def rest_to_rest_without_jerk(u: float) -> tuple[float, float, float]:
    """Return s, ds/du, d2s/du2 of s = 35 u^4 - 84 u^5 + 70 u^6 - 20 u^7.

    It goes from 0 to 1 with zero speed, acceleration and jerk at both ends; outside [0, 1] the motion rests.
    """
    if u <= 0.0:
        return 0.0, 0.0, 0.0
    if u >= 1.0:
        return 1.0, 0.0, 0.0
    rest = u * (1.0 - u)
    return (
        u * u * u * u * (35.0 + u * (u * (70.0 - 20.0 * u) - 84.0)),
        140.0 * rest * rest * rest,
        420.0 * rest * rest * (1.0 - 2.0 * u),
    )
