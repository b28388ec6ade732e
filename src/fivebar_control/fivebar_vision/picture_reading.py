# SPDX-License-Identifier: Apache-2.0
"""From a picture to the content of `vision/platform`."""

from __future__ import annotations

import math

from fivebar_control.estimation.platform_reading import PlatformReading
from fivebar_description.camera import CameraSettings
from fivebar_description.interface import NANOSECONDS
from fivebar_vision.detector import Picture
from fivebar_vision.localisation import PlatformTracker

NOT_SEEN = PlatformReading(math.nan, math.nan, math.nan, math.nan, math.nan)


def reading_of(tracker: PlatformTracker, settings: CameraSettings, picture: Picture) -> tuple[PlatformReading, int]:
    """Return the reading of a picture, and by how much (ns) the tag was exposed later than the picture's stamp.

    The rows of a rolling shutter are exposed one after the other; the stamp is that of the middle one.
    """
    sight = tracker.seen(picture)
    if sight is None:
        return NOT_SEEN, 0
    deviation_x, deviation_y = math.sqrt(sight.variance_x), math.sqrt(sight.variance_y)
    late = settings.readout * ((sight.row + 0.5) / settings.height - 0.5)
    correlation = sight.covariance / (deviation_x * deviation_y)
    return PlatformReading(sight.x, sight.y, deviation_x, deviation_y, correlation), round(late * NANOSECONDS)
