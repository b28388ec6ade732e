# SPDX-License-Identifier: Apache-2.0
"""The distance of the platform by which a motion is judged: from its reference in time, or from the path at any time.

The path joins the references of all samples by lines. Its distance is found by scalar functions, so that the compiled
loop, a predicted run and a recorded one are measured by the same code.
"""

from __future__ import annotations

import math
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

D = TypeVar("D")

TIMED, PATH = "timed", "path"
"""The distance of the platform by which a motion is judged."""

KEPT_TO = {TIMED: "reference", PATH: "path"}
"""From what that distance is, in words."""

FAR = 10.0
"""How many times as far as the place that has been found the line of the reference may be for a search to begin there:
from further away it would go all the way back to a robot that stands still while its reference goes on."""


def judged_distance(judge: str, timed: D, from_path: D) -> D:
    """Return the distance by which a motion is judged: from its timed reference, or from the path."""
    return from_path if judge == PATH else timed


class PathPlace(NamedTuple):
    """The nearest place of the path: its distance (m), and the number of the line on which it is."""

    distance: float
    line: int


def path_place(places: FloatArray, last: int, planned: int, x: float, y: float) -> PathPlace:
    """Return the nearest place of the path to (x, y) m.

    The search goes along the path while it comes nearer, from two lines: the last one, so that a robot that is late is
    measured where it is, and the planned one, so that no corner holds the search.

    Args:
        places: float64[n, 2 or more], x and y (m) of at least two samples; a line joins each to the next.
        last: the line on which the place before was.
        planned: the line on which the reference is.
        x, y: of the platform (m).
    """
    from_last, start = _nearer(places, last, x, y), min(planned, places.shape[0] - 2)
    if not line_distance(places, start, x, y) <= FAR * from_last.distance:
        return from_last
    from_planned = _nearer(places, start, x, y)
    return from_last if from_last.distance <= from_planned.distance else from_planned


def _nearer(places: FloatArray, line: int, x: float, y: float) -> PathPlace:
    """Return the place that is found from a line on, forward first: a path may turn back over itself."""
    best = line_distance(places, line, x, y)
    while line + 2 < places.shape[0]:
        further = line_distance(places, line + 1, x, y)
        if not further <= best:
            break
        best, line = further, line + 1
    while line > 0:
        before = line_distance(places, line - 1, x, y)
        if not before < best:
            break
        best, line = before, line - 1
    return PathPlace(best, line)


def line_distance(places: FloatArray, line: int, x: float, y: float) -> float:
    """Return the distance (m) of (x, y) from the line between a sample's place and the next one's."""
    x1, y1 = places[line, 0], places[line, 1]
    along_x, along_y = places[line + 1, 0] - x1, places[line + 1, 1] - y1
    squared = along_x * along_x + along_y * along_y
    share = 0.0
    if squared > 0.0:
        share = min(max(((x - x1) * along_x + (y - y1) * along_y) / squared, 0.0), 1.0)
    off_x, off_y = x - x1 - share * along_x, y - y1 - share * along_y
    return math.sqrt(off_x * off_x + off_y * off_y)


def path_distances(places: FloatArray, platform: FloatArray) -> FloatArray:
    """Return the distance (m) of each platform position from the path, [n]; NaN where either is not known.

    Args:
        places: float64[n, 2 or more], of the reference; samples without one are left out.
        platform: float64[n, 2 or more], x and y (m).
    """
    there = np.asarray(~np.isnan(places[:, :2]).any(axis=1))
    # a rest is one place, so that no search has to pass all its samples
    there[1:] &= (places[1:, :2] != places[:-1, :2]).any(axis=1)
    known, numbers = places[there], np.maximum(np.cumsum(there) - 1, 0).tolist()
    distances = np.full(len(platform), math.nan)
    if len(known) < 2:
        return distances
    line = 0
    for number, (x, y) in enumerate(platform[:, :2].tolist()):
        if math.isfinite(x + y):
            distances[number], line = path_place(known, line, numbers[number], x, y)
    return distances
