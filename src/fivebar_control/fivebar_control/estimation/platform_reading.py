# SPDX-License-Identifier: Apache-2.0
"""The content of `vision/platform`: the platform's position by a camera, and its uncertainty."""

from __future__ import annotations

from typing import NamedTuple


class PlatformReading(NamedTuple):
    """The platform's position from a picture, all NaN where it was not seen.

    Attributes:
        x, y: position (m).
        deviation_x, deviation_y: standard deviations (m).
        correlation: of the errors of x and y.
    """

    x: float
    y: float
    deviation_x: float
    deviation_y: float
    correlation: float


class StampedPosition(NamedTuple):
    """A position by the camera: its stamp (ns), the moment of that in samples, and what was seen."""

    stamp: int
    moment: float
    reading: PlatformReading


def used(reading: PlatformReading) -> tuple[float, float, float]:
    """Return the part of a reading that the estimator uses: x, y (m), and the larger standard deviation (m)."""
    return reading.x, reading.y, max(reading.deviation_x, reading.deviation_y)
