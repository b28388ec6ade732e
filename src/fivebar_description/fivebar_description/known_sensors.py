"""The findings of a calibration on a robot's sensors: the section `sensors` of a robot file."""

from __future__ import annotations

import math
from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting


class KnownSensors(NamedTuple):
    """Constant errors of sensors that are known, and that the estimator removes."""

    imu_clock: Annotated[
        float,
        Setting("Time by which the stamps of the IMU's clock are late.", "s", at_least=-1e3, at_most=1e3),
    ] = 0.0
    passive_zero: Annotated[
        float,
        Setting(
            "Reading of the passive joint's encoder where its angle is 0.", "rad", at_least=-math.pi, at_most=math.pi
        ),
    ] = 0.0

    def lagging(self, lag: float) -> KnownSensors:
        """Return the same for an IMU whose readings lag behind their stamps by a further time (s)."""
        return self._replace(imu_clock=self.imu_clock + lag)


NOTHING_KNOWN = KnownSensors()
