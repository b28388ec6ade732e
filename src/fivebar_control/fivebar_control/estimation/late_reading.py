# SPDX-License-Identifier: Apache-2.0
"""A reading of a sensor that comes after its sample, as the estimator takes it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

PASSIVE, GYROSCOPE, CAMERA, EXTRA = range(4)
"""The sensors, in the order in which an update takes their readings: the encoder on a passive joint, the gyroscope, the
camera, and a sensor from another package."""

SENSORS = 4


class LateReading(NamedTuple):
    """A reading of one of these sensors.

    Attributes:
        sensor: its number.
        made: moment of its stamp, in samples.
        value: angle (rad), rate (rad/s), or x of the platform (m); of a sensor from another package its own quantity.
        second: y of the platform (m) by the camera, else 0.
        deviation: standard deviation of either coordinate (m), as the camera says, else 0.
    """

    sensor: int
    made: float
    value: float
    second: float = 0.0
    deviation: float = 0.0


Readings = Sequence[LateReading] | NDArray[np.float64]
"""Readings of all late sensors; those of one sensor in the order in which they were made. As an array, a row each."""
