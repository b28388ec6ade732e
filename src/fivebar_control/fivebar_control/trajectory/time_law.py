"""Time laws: how a motion passes from 0 to 1 of its way between 0 and 1 of its duration."""

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
