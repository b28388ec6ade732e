"""Confidence intervals of shares."""

from __future__ import annotations

from typing import NamedTuple

CONFIDENCE = 0.95


class Interval(NamedTuple):
    """An interval of shares."""

    low: float
    high: float


def clopper_pearson(successes: int, runs: int) -> Interval:
    """Return the exact interval of a share for 95 %, by C. J. Clopper and E. S. Pearson (1934)."""
    # here, because scipy takes long to load
    from scipy.special import betaincinv

    tail = 0.5 * (1.0 - CONFIDENCE)
    low = 0.0 if successes == 0 else float(betaincinv(successes, runs - successes + 1, tail))
    high = 1.0 if successes == runs else float(betaincinv(successes + 1, runs - successes, 1.0 - tail))
    return Interval(low, high)


def upper_bound(successes: int, runs: int) -> float:
    """Return what a share exceeds with 5 % confidence only: the one-sided bound, of at least one run."""
    # here, because scipy takes long to load
    from scipy.special import betaincinv

    return 1.0 if successes == runs else float(betaincinv(successes + 1, runs - successes, CONFIDENCE))
