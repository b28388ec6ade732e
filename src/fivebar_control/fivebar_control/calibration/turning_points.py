# SPDX-License-Identifier: Apache-2.0
"""The elbow gap from the motors' encoders alone: the elbows' turning points on the Type 2 locus.

Whenever the platform passes through the stretched branch of the locus, both distal links are in line and the elbows as
far apart as they get: by l_12 + l_22. (On the folded branch they are nearest, with equal links in one place; such
passages have no turning point and are left out.) What the readings and the geometry in the file give there instead is
the elbow gap. It needs neither a gyroscope nor power, only a passage through the locus and beyond it by hand.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.calibration.closure import closure, distal_angles, geometry_of
from fivebar_control.calibration.record import CONTRADICTS, CalibrationRecord, ContradictsRobot, NotCalibratable, angles
from fivebar_description.parameters import FiveBar

FloatArray = NDArray[np.float64]

LARGEST_GAP = 4e-3
"""Largest difference (m) between the elbows' distance at a turning point and l_12 + l_22."""

DEPTH = 1e-3
"""How far (m) the elbows must come together on either side of a turning point: 14 mm of platform beside the locus."""

TOP = 3e-4
"""Part of the way (m) below the turning point that its distance is found from."""

LEAST_SAMPLES = 8

LEAST_DEVIATION = 1e-6
"""m."""


class TurningPoint(NamedTuple):
    """A passage through the stretched branch of the locus.

    Attributes:
        sample: at which the elbows are the furthest apart.
        gap: their distance beyond l_12 + l_22 (m).
        deviation: its standard deviation (m).
        row: [8], derivatives of the gap by the geometry.
    """

    sample: int
    gap: float
    deviation: float
    row: FloatArray


def turning_points(robot: FiveBar, record: CalibrationRecord, lag: float = 0.0) -> list[TurningPoint]:
    """Return the passages through the stretched branch of the locus of a recorded motion.

    Args:
        robot: the geometry before.
        record: readings of the motion.
        lag: by how much a motor that is dragged may lag behind its link (rad).

    Raises:
        ContradictsRobot: the robot's loop does not close at the recorded angles.
        NotCalibratable: there is no passage.
    """
    read = angles(record)
    geometry = geometry_of(robot)
    # with theta_2 towards the elbow of leg 1 the closure is what the elbows are apart beyond l_12 + l_22
    towards = distal_angles(geometry, read.values).mean(axis=1)
    closed = closure(geometry, read.values, towards)
    furthest = float(np.max(closed.gap))
    if furthest > LARGEST_GAP:
        raise ContradictsRobot(
            f"{CONTRADICTS}: the elbows come {1e3 * furthest:.1f} mm further apart than both distal links reach,"
            f" expected at most {1e3 * LARGEST_GAP:g} mm: is it the robot of the recording?"
        )
    passages = [(top, *_around(closed.gap, top, TOP)) for top in _tops(closed.gap) if closed.gap[top] >= -LARGEST_GAP]
    passages = [passage for passage in passages if passage[2] - passage[1] >= LEAST_SAMPLES]
    # a lag is alike in all passages, and their mean has all of it
    variance = read.resolution**2 / 12.0 + len(passages) * lag * lag
    points = []
    for top, begin, end in passages:
        time = np.linspace(-1.0, 1.0, end - begin)
        curve = np.polynomial.Polynomial.fit(time, closed.gap[begin:end], 4)
        gap = float(np.max(curve(np.linspace(-1.0, 1.0, 201))))
        deviation = float(np.sqrt(variance * np.sum(closed.by_motors[top] ** 2)))
        points.append(TurningPoint(top, gap, max(deviation, LEAST_DEVIATION), closed.by_geometry[top]))
    if not points:
        raise NotCalibratable(
            "no crossing: the elbows are never the furthest apart between two places where they are at least"
            f" {1e3 * DEPTH:g} mm nearer: lead the platform through the Type 2 locus and a few centimetres beyond"
        )
    return points


def _tops(values: FloatArray) -> list[int]:
    """Return the largest value of every stretch that is `DEPTH` lower on either side."""
    tops: list[int] = []
    top = bottom = 0
    rising = True
    for number in range(1, len(values)):
        if rising:
            if values[number] > values[top]:
                top = number
            elif values[number] < values[top] - DEPTH:
                if values[top] - np.min(values[: top + 1]) > DEPTH:
                    tops.append(top)
                rising, bottom = False, number
        elif values[number] < values[bottom]:
            bottom = number
        elif values[number] > values[bottom] + DEPTH:
            rising, top = True, number
    return tops


def _around(values: FloatArray, top: int, depth: float) -> tuple[int, int]:
    """Return the range of samples around a top that lie less than `depth` below it."""
    lower = values < values[top] - depth
    before, after = np.flatnonzero(lower[:top]), np.flatnonzero(lower[top:])
    begin = int(before[-1]) + 1 if before.size else 0
    return begin, top + int(after[0]) if after.size else len(values)
