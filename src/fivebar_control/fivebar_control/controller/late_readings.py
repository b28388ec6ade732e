# SPDX-License-Identifier: Apache-2.0
"""Readings that come after their samples, as the estimator takes them."""

from __future__ import annotations

from fivebar_control.estimation.late_reading import CAMERA, EXTRA, GYROSCOPE, PASSIVE, LateReading
from fivebar_control.estimation.platform_reading import PlatformReading, used
from fivebar_control.scenario.scenario import ControlScenario
from fivebar_description.interface import moment_of_stamp
from fivebar_description.readings import SensorReadings, stamp_of_time


def late_readings(readings: SensorReadings, scenario: ControlScenario) -> list[LateReading]:
    """Return those of some readings that the estimator of a scenario uses."""
    rate_hz, late = scenario.rate_hz, list[LateReading]()

    def moment(time: float) -> float:
        return moment_of_stamp(stamp_of_time(time), rate_hz)

    if scenario.gyro:
        usable_rate = scenario.imu.usable_rate
        late += [LateReading(GYROSCOPE, moment(turn.time), usable_rate(turn.angular_velocity)) for turn in readings.imu]
    if scenario.passive.leg:
        late += [LateReading(PASSIVE, moment(angle.time), angle.angle) for angle in readings.passive_angles]
    if scenario.sees:
        positions = ((moment(sight.time), used(PlatformReading(*sight[1:]))) for sight in readings.camera)
        late += [LateReading(CAMERA, stamp, *position) for stamp, position in positions]
    if scenario.extra_sensor:
        late += [LateReading(EXTRA, moment(reading.time), reading.value) for reading in readings.extra]
    return late
