# SPDX-License-Identifier: Apache-2.0
"""Sensors that are mounted, signed or scaled otherwise than the robot's file says: which would explain a recording.

A robot whose bases lie on one line is its own mirror image, in which all angles are reversed: a gyroscope that is
mounted upside down cannot be told from two encoders that count backwards, nor, without a gyroscope, one encoder that
counts backwards from the other.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from typing import NamedTuple

import numpy as np

from fivebar_control.calibration.record import CalibrationRecord, FloatArray, NotCalibratable, turning_axis
from fivebar_description.imu import Vector3

Change = Callable[[FloatArray], FloatArray]


def _as_they_are(values: FloatArray) -> FloatArray:
    return values


class AlternativeMounting(NamedTuple):
    """Another reading of a recording.

    Attributes:
        words: how it differs.
        motors: changes the motors' angles, [n, 2] (rad).
        gyroscope: changes the angular velocity, [m, 3] (rad/s).
    """

    words: str
    motors: Change = _as_they_are
    gyroscope: Change = _as_they_are

    def read(self, record: CalibrationRecord) -> CalibrationRecord:
        """Return the recording as it would then be."""
        return record._replace(
            motors=self.motors(record.motors), angular_velocity=self.gyroscope(record.angular_velocity)
        )

    @property
    def is_of_motors(self) -> bool:
        """Whether it is the motors' angles that differ."""
        return self.motors is not _as_they_are


def _motors(
    words: str, factors: tuple[float, float] = (1.0, 1.0), turn: tuple[float, float] = (0.0, 0.0)
) -> AlternativeMounting:
    """Return the reading with other factors of the motors' angles, turned by some quarters of a turn."""
    change = 0.5 * math.pi * np.array(turn)
    return AlternativeMounting(words, motors=lambda angles: angles * factors + change)


def _gyroscope(words: str, factor: float) -> AlternativeMounting:
    return AlternativeMounting(words, gyroscope=lambda rates: factor * rates)


DEGREE = math.pi / 180.0

READINGS = (
    _gyroscope(
        "the gyroscope's readings have the opposite sign: is it mounted upside down (imu.roll: 3.14159), or do both"
        " encoders count backwards?",
        -1.0,
    ),
    _gyroscope("the gyroscope's readings are in degrees per second: expected rad/s", DEGREE),
    _gyroscope(
        "the gyroscope's readings are in degrees per second and have the opposite sign: expected rad/s, and imu.roll:"
        " 3.14159 where it is mounted upside down",
        -DEGREE,
    ),
    _motors("the readings of q11 have the opposite sign: its encoder counts backwards", (-1.0, 1.0)),
    _motors("the readings of q21 have the opposite sign: its encoder counts backwards", (1.0, -1.0)),
    _motors("the readings of q11 and q21 have the opposite sign: both encoders count backwards", (-1.0, -1.0)),
    AlternativeMounting("q11 and q21 are exchanged", motors=lambda angles: angles[:, ::-1]),
    _motors("the readings of the motors are in degrees: expected rad", (DEGREE, DEGREE)),
    _motors("the readings of q11 are offset by half a turn", turn=(2.0, 0.0)),
    _motors("the readings of q21 are offset by half a turn", turn=(0.0, 2.0)),
    _motors("the readings of both motors are offset by half a turn", turn=(2.0, 2.0)),
    _motors("the angles of both motors count from the y axis: expected from the x axis", turn=(1.0, 1.0)),
    _motors("the angles of both motors count from the -y axis: expected from the x axis", turn=(-1.0, -1.0)),
)
"""Explanations that are tried on a recording that contradicts its robot."""

TURNED = math.radians(15.0)
"""Least angle (rad) between the axis that the gyroscope turns about and the declared one for it to be named."""

STEADY = 5.0
"""Least ratio of the readings' spread along that axis to that across it."""


def explanations(
    record: CalibrationRecord, attempt: Callable[[CalibrationRecord], object], of_motors: bool = False
) -> Iterator[str]:
    """Yield in words each other reading of a recording with which it can be calibrated.

    Args:
        record: as it was read.
        attempt: calibrates, and raises NotCalibratable or LinAlgError where that cannot be.
        of_motors: try only what is about the motors' angles.
    """
    for otherwise in READINGS:
        if of_motors and not otherwise.is_of_motors:
            continue
        try:
            attempt(otherwise.read(record))
        except (NotCalibratable, np.linalg.LinAlgError):
            continue
        yield otherwise.words


def turned_gyroscope(angular_velocity: FloatArray, declared: Vector3) -> tuple[AlternativeMounting, ...]:
    """Return the readings of a gyroscope that turns about another axis than the declared one, none where it does not.

    The axis is that along which the angular velocity varies most, in either direction.

    Args:
        angular_velocity: [m, 3], in the IMU's frame (rad/s), finite.
        declared: the axis that the link turns about, in that frame.
    """
    if len(angular_velocity) < 3:
        return ()
    axis, spread = turning_axis(angular_velocity, declared)
    expected = np.array(declared)
    if spread[0] <= STEADY * spread[1] or axis @ expected > math.cos(TURNED):
        return ()
    return tuple(_about(sign * axis, expected) for sign in (1.0, -1.0))


def _about(axis: FloatArray, expected: FloatArray) -> AlternativeMounting:
    """Return the reading in which the link turns about another axis in the IMU's frame than expected."""
    about, declared = (
        "({:.2f}, {:.2f}, {:.2f})".format(*(np.round(direction, 2) + 0.0)) for direction in (axis, expected)
    )
    return AlternativeMounting(
        f"the gyroscope is mounted otherwise: by its readings the link turns about {about} in the IMU's frame,"
        f" expected about {declared} by imu.roll, imu.pitch and imu.yaw",
        gyroscope=lambda rates: np.outer(rates @ axis, expected),
    )
