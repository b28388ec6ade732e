# SPDX-License-Identifier: Apache-2.0
"""The late sensors in the engine's loop: when their readings arrive, and what they read.

When a reading is made and arrives, and by how much it errs, is known before the run; what it measures, during it.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_bringup.scenario import Scenario
from fivebar_control.estimation.late_reading import CAMERA, EXTRA, GYROSCOPE, PASSIVE, SENSORS
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.model.state import Joints
from fivebar_description.optional import CAMERA_FRAMES, CAMERA_ON, optional_part
from fivebar_description.parameters import FiveBar
from fivebar_sim.effects.gyroscope import ImuClock, SampleSpan, frozen_samples, gain, jumps, missing_samples
from fivebar_sim.scalar_sensors import PassiveNumbers, extra_noise, passive_numbers, passive_reading
from fivebar_sim.sensors import (
    EXTRA_LOSSES,
    IMU_LOSSES,
    PASSIVE_LOSSES,
    gyro_errors,
    gyro_stream,
    made_readings,
    sensed_rate,
)

FloatArray = NDArray[np.float64]

ARRIVES, SENSOR, MADE, STAMP, ERROR_X, ERROR_Y, DEVIATION = range(7)
"""Columns of the readings that arrive: the sample with which one does, the sensor, the sample at which it is made, the
moment of its stamp (samples), and of a position by the camera its errors and standard deviation (m)."""


class EngineSensors(NamedTuple):
    """The late sensors of a crossing.

    Attributes:
        arrivals: float64[n, 7], the readings by arrival, those of one sensor in their order.
        gyro: whether there is a gyroscope.
        gyro_keep: of its low-pass, see `ImuSettings.gyro_keep`.
        gyro_errors: float64[N + 1], error of its reading at each sample (rad/s); [0] without a gyroscope.
        gyro_gain: how much it reads of a rate.
        gyro_limit: rate (rad/s) from which on it is at the end of its range.
        gyro_frozen: samples whose readings repeat the one before.
        leg: with an encoder on its passive joint, 0 for none.
        passive: that encoder.
        camera: whether there is a camera; pictures are not rendered here.
        extra: settings of a sensor from another package as numbers, None for none.
        extra_noise: float64[N + 1], normally distributed, for its reading at each sample; [0] without one.
    """

    arrivals: FloatArray
    gyro: bool
    gyro_keep: float
    gyro_errors: FloatArray
    gyro_gain: float
    gyro_limit: float
    gyro_frozen: SampleSpan
    leg: int
    passive: PassiveNumbers
    camera: bool
    extra: Any
    extra_noise: FloatArray


def engine_sensors(scenario: Scenario, samples: int) -> EngineSensors:
    """Return the late sensors of a scenario's estimator, for a run of so many samples."""
    imu, faults = scenario.imu, scenario.plant.gyroscope
    rate_hz, seed = scenario.rate_hz, scenario.plant.seed
    extra = scenario.extra()
    errors = noise = np.zeros(0)
    if scenario.gyro:
        errors = gyro_errors(imu, gyro_stream(seed), samples) + jumps(faults, rate_hz, samples)
    if extra is not None:
        noise = extra_noise(seed).standard_normal(samples)
    rows = sorted(_arrivals(scenario, samples), key=lambda row: row[ARRIVES])
    return EngineSensors(
        arrivals=np.array(rows, dtype=np.float64).reshape(len(rows), 7),
        gyro=scenario.gyro,
        gyro_keep=imu.gyro_keep(1.0 / rate_hz),
        gyro_errors=errors,
        gyro_gain=gain(faults),
        gyro_limit=imu.gyro_limit(),
        gyro_frozen=frozen_samples(faults, rate_hz),
        leg=scenario.passive.leg,
        passive=passive_numbers(scenario.passive, seed),
        camera=scenario.sees and scenario.ekf.camera,
        extra=None if extra is None else extra.numbers,
        extra_noise=noise,
    )


def _arrivals(scenario: Scenario, samples: int) -> Iterator[tuple[float, ...]]:
    """Yield the readings that arrive, as the columns have them, sensor by sensor."""
    rate_hz, seed = scenario.rate_hz, scenario.plant.seed
    moments = np.arange(samples, dtype=np.float64)
    if scenario.gyro:
        faults = scenario.plant.gyroscope
        stamps = ImuClock(scenario.imu, faults, rate_hz, seed).moments(samples)
        missing = missing_samples(faults, rate_hz)
        with_reading = made_readings(scenario.imu, rate_hz, seed, samples, IMU_LOSSES, missing)
        yield from _of_schedule(GYROSCOPE, with_reading, scenario.imu.schedule(rate_hz).latency, stamps)
    if scenario.passive.leg:
        with_reading = made_readings(scenario.passive, rate_hz, seed, samples, PASSIVE_LOSSES)
        yield from _of_schedule(PASSIVE, with_reading, scenario.passive.schedule(rate_hz).latency, moments)
    if scenario.sees and scenario.ekf.camera:
        frame_of, spread = optional_part(CAMERA_FRAMES, CAMERA_ON), scenario.camera.deviation
        for sample in range(samples):
            frame = frame_of(scenario.camera, rate_hz, seed, sample)
            if frame is not None and frame.arrival >= 0:
                errors = spread * frame.noise_x, spread * frame.noise_y
                yield frame.arrival, CAMERA, frame.sample, frame.sample, *errors, spread
    extra = scenario.extra()
    if extra is not None:
        with_reading = made_readings(extra, rate_hz, seed, samples, EXTRA_LOSSES)
        yield from _of_schedule(EXTRA, with_reading, extra.schedule(rate_hz).latency, moments)


def _of_schedule(
    sensor: int, with_reading: NDArray[np.bool_], latency: int, stamps: FloatArray
) -> Iterator[tuple[float, ...]]:
    for sample in np.flatnonzero(with_reading).tolist():
        yield sample + latency, sensor, sample, stamps[sample], 0.0, 0.0, 0.0


class LateState(NamedTuple):
    """State of the late sensors so far; the arrays are changed in place.

    Attributes:
        values: float64[N + 1, SENSORS, 2], at each sample: what a reading made there has without the errors of a
            position, and y of the platform (m) for the camera.
        taken: float64[n, 5], readings for the estimator, as `LateReading`.
        next: row of the first reading that has not arrived yet.
        turned: angle (rad) of the link that carries the gyroscope.
        rate: what the gyroscope senses of its rate (rad/s), without errors.
        reading: its last reading (rad/s), also of samples at which none is made.
    """

    values: FloatArray
    taken: FloatArray
    next: int
    turned: float
    rate: float
    reading: float


def nothing_read(settings: Any, robot: FiveBar, q11: float, q12: float, q21: float, q22: float, noise: float) -> float:
    """Return the reading of a sensor that is not there."""
    return math.nan


extra_read: Callable[..., float] = nothing_read
"""Reading of a sensor from another package, to be bound before."""


def unsensed(sensors: EngineSensors, exact: Joints, samples: int) -> LateState:
    """Return the late sensors before the first sample of so many, on a robot with exact joints."""
    count = sensors.arrivals.shape[0]
    values = np.zeros((samples if count > 0 else 0, SENSORS, 2))
    return LateState(values, np.zeros((count, 5)), 0, exact.q21 + exact.q22, exact.dq21 + exact.dq22, 0.0)


def sensed(
    sensors: EngineSensors, before: LateState, robot: FiveBar, exact: Joints, number: int, period: float
) -> LateState:
    """Return the late sensors after what they sense at a sample.

    Args:
        sensors: of the crossing.
        before: at the sample before.
        robot: with its actual parameters.
        exact: its joints at the sample.
        number: of the sample.
        period: between two samples (s).
    """
    values = before.values
    turned, rate, reading = before.turned, before.rate, before.reading
    if values.shape[0] == 0:
        return before
    if sensors.gyro:
        turned = exact.q21 + exact.q22
        rate = sensed_rate(sensors.gyro_keep, before.rate, (turned - before.turned) / period, exact.dq21 + exact.dq22)
        if not sensors.gyro_frozen.first <= number < sensors.gyro_frozen.end:
            reading = sensors.gyro_gain * rate + sensors.gyro_errors[number]
        values[number, GYROSCOPE, 0] = math.inf if abs(reading) >= sensors.gyro_limit else reading
    if sensors.leg > 0:
        angle = exact.q12 if sensors.leg == 1 else exact.q22
        values[number, PASSIVE, 0] = passive_reading(sensors.passive, angle)
    if sensors.camera:
        there = state_from_joints(
            robot, exact.q11, exact.q12, exact.q21, exact.q22, exact.dq11, exact.dq12, exact.dq21, exact.dq22
        )
        values[number, CAMERA, 0], values[number, CAMERA, 1] = there.x, there.y
    if sensors.extra_noise.shape[0] > 0:
        noise = sensors.extra_noise[number]
        values[number, EXTRA, 0] = extra_read(sensors.extra, robot, exact.q11, exact.q12, exact.q21, exact.q22, noise)
    return LateState(values, before.taken, before.next, turned, rate, reading)


class ArrivedWith(NamedTuple):
    """Readings that come with a sample, float64[n, 5] as `LateReading`, and the sensors after that."""

    readings: FloatArray
    sensed: LateState


def arrived(sensors: EngineSensors, now: LateState, number: int) -> ArrivedWith:
    """Return what comes with a sample that reaches the controllers.

    What was to come with samples that did not reach them is lost, but for positions by the camera, which come with the
    next one.
    """
    count, position = 0, now.next
    while position < sensors.arrivals.shape[0] and sensors.arrivals[position, ARRIVES] <= number:
        row = sensors.arrivals[position]
        sensor, made = int(row[SENSOR]), int(row[MADE])
        value = now.values[made, sensor, 0]
        if sensor == CAMERA or (row[ARRIVES] == number and not math.isnan(value)):
            now.taken[count, 0], now.taken[count, 1] = row[SENSOR], row[STAMP]
            now.taken[count, 2] = value + row[ERROR_X]
            now.taken[count, 3] = now.values[made, sensor, 1] + row[ERROR_Y]
            now.taken[count, 4] = row[DEVIATION]
            count += 1
        position += 1
    later = LateState(now.values, now.taken, position, now.turned, now.rate, now.reading)
    return ArrivedWith(now.taken[:count], later)
