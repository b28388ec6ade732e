# SPDX-License-Identifier: Apache-2.0
"""Exact readings of a robot that is led along a path, from the closed-form geometry of the model."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from fivebar_control.calibration.record import CalibrationRecord
from fivebar_control.model.kinematics import distal_acceleration, joints_of, state_from_platform
from fivebar_control.model.state import WorkingMode
from fivebar_description.imu import ImuSettings
from fivebar_description.parameters import FiveBar, LegParameters
from fivebar_sim.sensors import Imu

FloatArray = NDArray[np.float64]

PATH = (
    (0.0, 0.15),
    (0.0, 0.03),
    (0.05, 0.14),
    (0.03, 0.04),
    (-0.02, 0.15),
    (-0.03, 0.04),
    (-0.05, 0.14),
    (0.0, 0.03),
    (0.0, 0.15),
)
"""Eight passages through the Type 2 locus (m), elbows outwards."""

MODE = (1, -1)

BIAS = 0.015
"""rad/s, of the gyroscope."""


def with_errors(robot: FiveBar, errors: FloatArray) -> FiveBar:
    """The robot with other l_11, l_12, l_21, l_22 and bases (m), [6]."""

    def leg(one: LegParameters, proximal: float, distal: float, base: float) -> LegParameters:
        return one._replace(proximal=one.proximal + proximal, distal=one.distal + distal, base_x=one.base_x + base)

    l_11, l_12, l_21, l_22, base_1, base_2 = errors.tolist()
    return FiveBar(leg(robot.leg1, l_11, l_12, base_1), leg(robot.leg2, l_21, l_22, base_2), robot.mass)


def led(
    robot: FiveBar,
    zeros: tuple[float, float] = (0.0, 0.0),
    path: tuple[tuple[float, float], ...] = PATH,
    seconds: float = 0.6,
    rate_hz: int = 500,
    counts: int = 0,
    imu: ImuSettings | None = None,
    seed: int = 0,
    mode: WorkingMode = MODE,
) -> CalibrationRecord:
    """Readings along straight segments between rests, each of so many seconds; the accelerometer's only with `imu`."""
    count = round((len(path) - 1) * seconds * rate_hz)
    settings = imu if imu is not None else ImuSettings(gyro_bias=BIAS)
    sensor = Imu(settings, rate_hz, seed)
    motors, rates, forces = [], [], []
    for number in range(count + 1):
        place, speed, acceleration = _at(path, seconds, number / rate_hz)
        state = state_from_platform(robot, mode, *place, *speed)
        motors.append((state.leg1.q1, state.leg2.q1))
        u_x, u_y = state.leg2.u_x, state.leg2.u_y
        own = (u_x * acceleration[0] + u_y * acceleration[1], u_x * acceleration[1] - u_y * acceleration[0])
        reading = sensor.read(
            own,
            state.leg2.q1 + state.leg2.q2,
            state.leg2.dtheta,
            distal_acceleration(robot.leg2, state.leg2, *acceleration),
        )
        rates.append(reading.angular_velocity)
        forces.append(reading.acceleration)
    angles = np.unwrap(np.array(motors), axis=0) + np.array(zeros)
    if counts > 0:
        step = 2.0 * math.pi / counts
        angles = np.floor(angles / step) * step
    times = np.arange(count + 1) / rate_hz
    acceleration = np.array(forces) if imu is not None else np.zeros((count + 1, 3))
    return CalibrationRecord(times, angles, np.zeros_like(angles), times, np.array(rates), acceleration)


def places(
    path: tuple[tuple[float, float], ...] = PATH, seconds: float = 0.6, rate_hz: int = 500
) -> list[tuple[float, float]]:
    """The platform (m) at the times of the same motion."""
    return [_at(path, seconds, k / rate_hz)[0] for k in range(round((len(path) - 1) * seconds * rate_hz) + 1)]


def passive_angles(
    robot: FiveBar, leg: int, path: tuple[tuple[float, float], ...] = PATH, seconds: float = 0.6, rate_hz: int = 500
) -> FloatArray:
    """The exact q_i2 of a leg (rad) at the times of the same motion, without jumps."""
    angles = []
    for number in range(round((len(path) - 1) * seconds * rate_hz) + 1):
        place, speed, _ = _at(path, seconds, number / rate_hz)
        angles.append(joints_of(state_from_platform(robot, MODE, *place, *speed))[1 if leg == 1 else 3])
    return np.unwrap(np.array(angles))


def _at(path: tuple[tuple[float, float], ...], seconds: float, time: float) -> list[tuple[float, float]]:
    """Place, speed and acceleration on the quintic between two rests."""
    segment = min(int(time / seconds), len(path) - 2)
    s = time / seconds - segment
    (x0, y0), (x1, y1) = path[segment], path[segment + 1]
    laws = (
        s**3 * (10.0 - 15.0 * s + 6.0 * s * s),
        30.0 * s * s * (1.0 - s) ** 2 / seconds,
        60.0 * s * (1.0 - s) * (1.0 - 2.0 * s) / seconds**2,
    )
    first = [(x0, y0), (0.0, 0.0), (0.0, 0.0)]
    return [(x + law * (x1 - x0), y + law * (y1 - y0)) for (x, y), law in zip(first, laws, strict=True)]
