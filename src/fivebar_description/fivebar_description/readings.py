# SPDX-License-Identifier: Apache-2.0
"""Readings of the sensors as they come with a sample, between a robot and whoever controls it in one process."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_description.errors import InputError
from fivebar_description.imu import Vector3
from fivebar_description.interface import NANOSECONDS, sample_stamp_ns

Pair = tuple[float, float]
Quadruple = tuple[float, float, float, float]


class TimedTurn(NamedTuple):
    """A reading of the IMU.

    Attributes:
        time: at which it was made, by its clock (s since sample 0).
        angular_velocity: in the IMU's frame (rad/s).
        acceleration: in the IMU's frame (m/s^2), None where there is no accelerometer. No controller uses it.
    """

    time: float
    angular_velocity: Vector3
    acceleration: Vector3 | None = None


class TimedAngle(NamedTuple):
    """A reading of the encoder on a passive joint: when it was made (s since sample 0), and the angle (rad)."""

    time: float
    angle: float


class TimedValue(NamedTuple):
    """A reading of a sensor from another package: when it was made (s since sample 0), and the value in its unit."""

    time: float
    value: float


class TimedPosition(NamedTuple):
    """The platform's position by a camera, NaN where the picture does not show it.

    Attributes:
        time: of the exposure (s since sample 0).
        x, y: position (m).
        deviation_x, deviation_y: standard deviations (m).
        correlation: of the errors of x and y.
    """

    time: float
    x: float
    y: float
    deviation_x: float
    deviation_y: float
    correlation: float = 0.0


class SensorReadings(NamedTuple):
    """Readings that come with a sample; None or empty was not read. A sample without angles is a lost one.

    Attributes:
        time: of the sample (s since sample 0), by default one period after the sample before.
        motor_angles: q11, q21 (rad).
        motor_torques: applied over the period before (Nm), by default as they were commanded.
        joint_angles: q11, q12, q21, q22 (rad), of a robot that measures all of them.
        joint_velocities: likewise (rad/s).
        imu, passive_angles, camera, extra: readings that have come since the sample before.
    """

    time: float | None = None
    motor_angles: Pair | None = None
    motor_torques: Pair | None = None
    joint_angles: Quadruple | None = None
    joint_velocities: Quadruple | None = None
    imu: tuple[TimedTurn, ...] = ()
    passive_angles: tuple[TimedAngle, ...] = ()
    camera: tuple[TimedPosition, ...] = ()
    extra: tuple[TimedValue, ...] = ()

    @property
    def present(self) -> bool:
        """Whether the sample has come: with the angles of the motors, or of all joints."""
        return self.motor_angles is not None or self.joint_angles is not None

    def check(self) -> None:
        """Refuse readings that are none.

        Raises:
            InputError: a number is missing or too many, or is not finite.
        """
        if self.time is not None:
            _check("time", (self.time,), 1)
        if self.motor_angles is not None:
            _check("motor_angles", self.motor_angles, 2)
        if self.motor_torques is not None:
            _check("motor_torques", self.motor_torques, 2)
        if self.joint_angles is not None:
            _check("joint_angles", self.joint_angles, 4)
        if self.joint_velocities is not None:
            _check("joint_velocities", self.joint_velocities, 4)
        for turn in self.imu:
            _check("imu", (turn.time, *turn.angular_velocity), 4)
        for angle in self.passive_angles:
            _check("passive_angles", angle, 2)
        for value in self.extra:
            _check("extra", value, 2)
        for position in self.camera:
            _check("camera", (position.time,), 1)


def _check(name: str, values: tuple[float, ...], count: int) -> None:
    # a sum is finite where all are, as far as they are angles, rates, torques or times
    if len(values) == count and math.isfinite(sum(values)):
        return
    numbers = "a finite number" if count == 1 else f"{count} finite numbers"
    raise InputError(f"{name}: {tuple(values)}: expected {numbers}")


def stamp_of_time(time: float) -> int:
    """Return the stamp (ns) of a time (s since sample 0)."""
    return sample_stamp_ns(0, 1) + round(time * NANOSECONDS)


def time_of_stamp(stamp_ns: int) -> float:
    """Return the time (s since sample 0) of a stamp (ns)."""
    return (stamp_ns - sample_stamp_ns(0, 1)) / NANOSECONDS
