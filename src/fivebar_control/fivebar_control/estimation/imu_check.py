"""The acceleration check of section 4.3: an independent look at whether the platform follows its reference."""

from __future__ import annotations

import math


def acceleration_error(measured: tuple[float, float], desired: tuple[float, float]) -> float:
    """Return the measured minus the desired magnitude of the in-plane acceleration (m/s^2).

    Magnitudes are compared because the IMU turns with the distal link; in-plane, because gravity is along its z axis.
    """
    return math.hypot(*measured) - math.hypot(*desired)
