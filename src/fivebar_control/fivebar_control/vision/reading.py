"""The content of `vision/platform`: the platform's position in a picture, and its uncertainty."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_description.camera import CameraSettings


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


NOT_SEEN = PlatformReading(math.nan, math.nan, math.nan, math.nan, math.nan)


def used(reading: PlatformReading) -> tuple[float, float, float]:
    """Return the part of a reading that the estimator uses: x, y (m), and the larger standard deviation (m)."""
    return reading.x, reading.y, max(reading.deviation_x, reading.deviation_y)


def simulated_reading(settings: CameraSettings, x: float, y: float) -> PlatformReading:
    """Return the reading of a position (m) that was simulated without a picture."""
    return PlatformReading(x, y, settings.deviation, settings.deviation, 0.0)
