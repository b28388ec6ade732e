# SPDX-License-Identifier: Apache-2.0
"""SensorReadings that come after their samples, as the estimator takes them."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_control.estimation.estimator import PositionFix
from fivebar_control.estimation.platform_reading import PlatformReading, used
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.interface import moment_of_stamp
from fivebar_description.readings import SensorReadings, stamp_of_time


class EstimatorReadings(NamedTuple):
    """Late readings in the order of the estimator's arguments, each with its moment in samples."""

    rates: list[tuple[float, float]]
    elbows: list[tuple[float, float]]
    seen: list[PositionFix]


def estimator_readings(readings: SensorReadings, scenario: ControlScenario) -> EstimatorReadings:
    """Return those of some readings that the estimator of a scenario uses."""
    rate_hz, usable_rate = scenario.rate_hz, scenario.imu.usable_rate

    def moment(time: float) -> float:
        return moment_of_stamp(stamp_of_time(time), rate_hz)

    return EstimatorReadings(
        [(moment(one.time), usable_rate(one.angular_velocity)) for one in readings.imu] if scenario.gyro else [],
        [(moment(one.time), one.angle) for one in readings.passive_angles] if scenario.passive.leg else [],
        [PositionFix(moment(one.time), *used(PlatformReading(*one[1:]))) for one in readings.camera]
        if scenario.sees
        else [],
    )
