"""What a recording does not show: directions of the geometry in which it says less than was known before."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.calibration.closure import BASE_1, BASE_2, GEOMETRY, ZERO_1
from fivebar_control.calibration.result import Calibration

FloatArray = NDArray[np.float64]

ALIKE = 0.9
"""Cosine between a direction and one with a name, from which on it is called so."""

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


def unseen(found: Calibration) -> list[Unseen]:
    """Return the directions in which the recording says less than was known before, the worst first.

    From the singular values of the recording's information on the geometry, the gyroscope's parameters eliminated, in
    units of the standard deviations before.
    """
    count = len(GEOMETRY)
    free = found.before[:count] > 1e-8
    kept = np.flatnonzero(free)
    if not kept.size:
        return []
    rest = np.arange(count, len(found.values))
    prior = np.diag(1.0 / found.before[rest] ** 2)
    own = found.information[np.ix_(rest, rest)] + prior
    mixed = found.information[np.ix_(kept, rest)]
    information = found.information[np.ix_(kept, kept)] - mixed @ np.linalg.solve(own, mixed.T)
    scale = found.before[kept]
    directions, strengths, _ = np.linalg.svd(information * np.outer(scale, scale), hermitian=True)
    result = []
    for strength, direction in sorted(zip(strengths.tolist(), directions.T, strict=True), key=lambda one: one[0]):
        if strength < 1.0:
            whole = np.zeros(count)
            whole[kept] = direction * scale
            result.append(Unseen(_words(whole, found), 1.0 / (1.0 + strength)))
    return result


def _words(direction: FloatArray, found: Calibration) -> str:
    """Return what a direction (m, rad) is; angles count by the length of the proximal link."""
    weights = np.ones(len(GEOMETRY))
    weights[ZERO_1:] = found.values[0]
    weighted = direction * weights
    weighted /= np.linalg.norm(weighted)
    scale = np.concatenate((found.values[:ZERO_1], np.zeros(2)))
    scale[found.before[: len(GEOMETRY)] <= 1e-8] = 0.0
    shift = np.zeros(len(GEOMETRY))
    shift[[BASE_1, BASE_2]] = 1.0
    for named, words in ((scale, SCALE), (shift, SHIFT)):
        if abs(named @ weighted) > ALIKE * np.linalg.norm(named):
            return words
    largest = np.argmax(np.abs(weighted))
    weighted = weighted / weighted[largest]
    parts = [f"{value:+.1f} {name}" for name, value in zip(GEOMETRY, weighted, strict=True) if abs(value) >= SMALL]
    return " ".join(parts).removeprefix("+").replace("1.0 ", "")
