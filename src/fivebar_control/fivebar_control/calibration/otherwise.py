"""Sensors that are mounted, signed or scaled otherwise than the robot's file says: which would explain a recording.

A robot whose bases lie on one line is its own mirror image, in which all angles are reversed: a gyroscope that is
mounted upside down cannot be told from two encoders that count backwards.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from fivebar_control.calibration.record import CalibrationRecord


class Otherwise(NamedTuple):
    """Another reading of a recording: how it differs, in words, and the recording as it would then be."""

    words: str
    read: Callable[[CalibrationRecord], CalibrationRecord]


def _motors(words: str, factors: tuple[float, float] = (1.0, 1.0), turn: tuple[float, float] = (0.0, 0.0)) -> Otherwise:
    """Return the reading with other factors of the motors' angles, turned by some quarters of a turn."""
    change = 0.5 * math.pi * np.array(turn)
    return Otherwise(words, lambda record: record._replace(motors=record.motors * factors + change))


def _gyroscope(words: str, factor: float) -> Otherwise:
    return Otherwise(words, lambda record: record._replace(angular_velocity=factor * record.angular_velocity))


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
    Otherwise("q11 and q21 are exchanged", lambda record: record._replace(motors=record.motors[:, ::-1])),
    _motors("the readings of the motors are in degrees: expected rad", (DEGREE, DEGREE)),
    _motors("the readings of q11 are offset by half a turn", turn=(2.0, 0.0)),
    _motors("the readings of q21 are offset by half a turn", turn=(0.0, 2.0)),
    _motors("the readings of both motors are offset by half a turn", turn=(2.0, 2.0)),
    _motors("the angles of both motors count from the y axis: expected from the x axis", turn=(1.0, 1.0)),
    _motors("the angles of both motors count from the -y axis: expected from the x axis", turn=(-1.0, -1.0)),
)
"""What is tried on a recording that contradicts its robot."""
