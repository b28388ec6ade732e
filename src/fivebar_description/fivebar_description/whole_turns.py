# SPDX-License-Identifier: Apache-2.0
"""Angles and counters without the whole turns by which other programs wrap or offset them."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

LARGEST_CHANGE = 1.0
"""Largest change (rad) between two angles, besides whole turns, for these to be taken off: more is no mere wrap."""

MOST_TURNS = 1000
"""Most whole turns that are taken off: a larger number is no angle."""

SPAN_32 = 2**32
"""Values of a 32-bit counter."""


def same_turn(angle: float, near: float) -> float:
    """Return an angle (rad) without the whole turns by which it differs from one that is near it.

    Any other angle, and one that differs by no whole turn, is returned as it is.
    """
    apart = angle - near
    if not math.tau - LARGEST_CHANGE < abs(apart) <= MOST_TURNS * math.tau:
        return angle
    turns = round(apart / math.tau)
    return angle - turns * math.tau if abs(apart - turns * math.tau) < LARGEST_CHANGE else angle


def nearest_turn(angle: float, near: float) -> float:
    """Return an angle (rad) of all turns on the one that brings it nearest to another; as it is where that is NaN."""
    return angle + math.tau * round((near - angle) / math.tau) if math.isfinite(near) else angle


def turns_between(angle: float, same: float) -> int:
    """Return how many whole turns an angle is beyond what `same_turn` has made of it."""
    beyond = angle - same
    return round(beyond / math.tau) if abs(beyond) > LARGEST_CHANGE else 0


def continuous(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return columns of angles [n, m] (rad) without jumps by whole turns; those without any as they are."""
    columns = []
    for column in angles.T.tolist():
        near, followed = math.nan, []
        for angle in column:
            followed.append(same_turn(angle, near))
            near = near if math.isnan(followed[-1]) else followed[-1]
        columns.append(followed)
    unwrapped = np.array(columns).T.reshape(angles.shape)
    return angles if np.array_equal(unwrapped, angles, equal_nan=True) else unwrapped


def counter_change(before: int, now: int) -> int:
    """Return by how much a 32-bit counter has changed, which may have wrapped between two readings."""
    return (now - before + SPAN_32 // 2) % SPAN_32 - SPAN_32 // 2
