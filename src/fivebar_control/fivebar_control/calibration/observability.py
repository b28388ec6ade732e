# SPDX-License-Identifier: Apache-2.0
"""Directions of the geometry that a recording does not show: it says less about them than was known before."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.calibration.closure import BASE_1, BASE_2, GEOMETRY, ZERO_1
from fivebar_control.calibration.result import Calibration

FloatArray = NDArray[np.float64]

FAR = 1e6
"""Strength that is given to directions that are not looked at."""

SMALL = 0.25
"""Part of the largest component below which one is left out of a direction's words."""

SCALE, SHIFT = "the scale: all lengths and bases in proportion", "both bases together: where the origin is"


class Unseen(NamedTuple):
    """A direction that the recording does not show.

    Attributes:
        words: what it is.
        share: variance after the calibration over that before.
    """

    words: str
    share: float


def unseen(calibration: Calibration) -> list[Unseen]:
    """Return the directions in which the recording says less than was known before, the worst first.

    From the eigenvalues of the recording's information on the geometry, the gyroscope's parameters eliminated, in
    units of the standard deviations before.
    """
    count = len(GEOMETRY)
    free = calibration.before[:count] > 1e-8
    kept = np.flatnonzero(free)
    if not kept.size:
        return []
    rest = np.arange(count, len(calibration.values))
    prior = np.diag(1.0 / calibration.before[rest] ** 2)
    own = calibration.information[np.ix_(rest, rest)] + prior
    mixed = calibration.information[np.ix_(kept, rest)]
    information = calibration.information[np.ix_(kept, kept)] - mixed @ np.linalg.solve(own, mixed.T)
    scale = calibration.before[kept]
    scaled = information * np.outer(scale, scale)
    after = np.linalg.inv(np.eye(len(kept)) + scaled)
    result, known = list[Unseen](), np.zeros((len(kept), 0))
    for whole, words in _named(calibration):
        direction = whole[kept] / scale
        # what is left of it without those before
        direction -= known @ (known.T @ direction)
        direction /= np.linalg.norm(direction)
        strength = float(direction @ scaled @ direction)
        if strength < 1.0:
            result.append(Unseen(words, float(direction @ after @ direction)))
            known = np.column_stack((known, direction))
    # directions of equal strength are no more than a plane: the named ones are left out of it
    outside = np.eye(len(kept)) - known @ known.T
    strengths, directions = np.linalg.eigh(outside @ scaled @ outside + FAR * known @ known.T)
    for strength, direction in zip(strengths.tolist(), directions.T, strict=True):
        if strength < 1.0:
            whole = np.zeros(count)
            whole[kept] = direction * scale
            result.append(Unseen(_words(whole, calibration), float(direction @ after @ direction)))
    return sorted(result, key=lambda combination: -combination.share)


def _named(calibration: Calibration) -> list[tuple[FloatArray, str]]:
    """Return the directions of the geometry (m, rad) that have a name and are free, with it."""
    held = calibration.before[: len(GEOMETRY)] <= 1e-8
    scale = np.concatenate((calibration.values[:ZERO_1], np.zeros(2)))
    shift = np.zeros(len(GEOMETRY))
    shift[[BASE_1, BASE_2]] = 1.0
    return [
        (direction, words)
        for direction, words in ((scale, SCALE), (shift, SHIFT))
        if not np.any(held & (direction != 0.0))
    ]


def _words(direction: FloatArray, calibration: Calibration) -> str:
    """Return what a direction (m, rad) is; angles count by the length of the proximal link."""
    weights = np.ones(len(GEOMETRY))
    weights[ZERO_1:] = calibration.values[0]
    weighted = direction * weights
    weighted /= np.linalg.norm(weighted)
    largest = np.argmax(np.abs(weighted))
    weighted = weighted / weighted[largest]
    parts = [f"{value:+.1f} {name}" for name, value in zip(GEOMETRY, weighted, strict=True) if abs(value) >= SMALL]
    return " ".join(parts).removeprefix("+").replace("1.0 ", "")
