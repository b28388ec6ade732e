# SPDX-License-Identifier: Apache-2.0
"""Reads what a robot is calibrated from: a bag, and a file of touched points."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import Field, model_validator

from fivebar_bringup.bag.recording import FloatArray, IntArray, Recording
from fivebar_bringup.errors import BagError
from fivebar_bringup.identify.reading import joint_columns
from fivebar_control.calibration.passive import PassiveReadings
from fivebar_control.calibration.record import NOT_SEEN, CalibrationRecord, SeenPositions, TouchedPoint
from fivebar_description.interface import (
    ACTIVE_JOINTS,
    IMU_DATA,
    JOINT_STATES,
    MOTOR_STATES,
    NANOSECONDS,
    PASSIVE_STATES,
    VISION_NAMES,
    VISION_PLATFORM,
    Topic,
)
from fivebar_description.physical_bounds import Positive
from fivebar_description.sensors import PassiveEncoder
from fivebar_description.strict_yaml import InputError, StrictModel, read_yaml
from fivebar_description.whole_turns import continuous

LEAST_READINGS = 100
"""Least number of readings of motors and of the IMU."""


class Point(StrictModel):
    """One touched point: x and y of the platform (m), and the time in the bag (s) or both motors' readings (rad)."""

    x: float
    y: float
    time: Annotated[float, Field(ge=0)] | None = None
    q11: float | None = None
    q21: float | None = None

    @model_validator(mode="after")
    def _placed(self) -> Point:
        read = self.q11 is not None and self.q21 is not None
        if (self.time is None) == (not read) or (self.q11 is None) != (self.q21 is None):
            raise ValueError("expected either time, or q11 and q21")
        return self


class TouchedFile(StrictModel):
    """A file of touched points, measured in the robot's frame to `deviation_m` (standard deviation)."""

    deviation_m: Positive
    points: Annotated[tuple[Point, ...], Field(strict=False, min_length=1)]


def read_record(recording: Recording, with_imu: bool = True) -> CalibrationRecord:
    """Return the readings of motors and IMU.

    Without an IMU its readings are left empty.

    Raises:
        BagError: the bag lacks a topic, or its readings are no numbers.
    """
    topic = _motors(recording)
    recording.refuse_clock_steps(topic, *((IMU_DATA,) if with_imu else ()))
    motors = joint_columns(recording, topic, ACTIVE_JOINTS, "position")
    stamps, first = np.unique(recording.stamps(topic), return_index=True)
    if len(stamps) < LEAST_READINGS:
        raise BagError(recording.path, f"/{topic.name}: {len(stamps)} samples: too short to calibrate anything")
    torques = np.zeros_like(motors)
    if recording.field(topic, "effort").size:
        torques = joint_columns(recording, topic, ACTIVE_JOINTS, "effort")
    imu_stamps, velocity, acceleration = _imu(recording) if with_imu else _no_imu()
    start = int(stamps[0])
    return CalibrationRecord(
        times=(stamps - start) / NANOSECONDS,
        motors=motors[first],
        torques=torques[first],
        imu_times=(imu_stamps - start) / NANOSECONDS,
        angular_velocity=velocity,
        acceleration=acceleration,
    )


def read_passive(recording: Recording, leg: int) -> PassiveReadings | None:
    """Return the readings of the encoder on a leg's passive joint, None where the bag has none."""
    if not recording.count(PASSIVE_STATES):
        return None
    recording.refuse_clock_steps(PASSIVE_STATES)
    angles = recording.values(PASSIVE_STATES, "position", (PassiveEncoder(leg).joint,))[:, 0]
    known = np.isfinite(angles)
    followed = continuous(angles[known, None])[:, 0]
    return PassiveReadings(leg, _since_start(recording, recording.stamps(PASSIVE_STATES))[known], followed)


def read_seen(recording: Recording) -> SeenPositions:
    """Return the platform by a camera, nothing where the bag has none.

    Raises:
        BagError: its readings have other names.
    """
    if not recording.count(VISION_PLATFORM):
        return NOT_SEEN
    recording.refuse_clock_steps(VISION_PLATFORM)
    columns = joint_columns(recording, VISION_PLATFORM, VISION_NAMES[:4], "position")
    stamps, first = np.unique(recording.stamps(VISION_PLATFORM), return_index=True)
    return SeenPositions(_since_start(recording, stamps), columns[first, :2], np.max(columns[first, 2:], axis=1))


def _motors(recording: Recording) -> Topic:
    """Return the topic that has the motors as they were measured."""
    return MOTOR_STATES if recording.count(MOTOR_STATES) else JOINT_STATES


def _since_start(recording: Recording, stamps: IntArray) -> FloatArray:
    """Return the times (s) of stamps (ns) since the first sample of the motors."""
    times: FloatArray = (stamps - int(np.min(recording.stamps(_motors(recording))))) / NANOSECONDS
    return times


def _imu(recording: Recording) -> tuple[IntArray, FloatArray, FloatArray]:
    if not recording.count(IMU_DATA):
        raise BagError(
            recording.path,
            f"/{IMU_DATA.name}: no readings: expected those of a gyroscope on the distal link of leg 2;"
            " --encoders-only calibrates the elbow gap without one",
        )
    stamps, first = np.unique(recording.stamps(IMU_DATA), return_index=True)
    if len(stamps) < LEAST_READINGS:
        raise BagError(recording.path, f"/{IMU_DATA.name}: {len(stamps)} readings: too few to calibrate anything")
    velocity = recording.field(IMU_DATA, "angular_velocity")[first]
    if not np.all(np.isfinite(velocity)):
        raise BagError(recording.path, f"/{IMU_DATA.name}: an angular velocity is not a number")
    return stamps, velocity, recording.field(IMU_DATA, "linear_acceleration")[first]


def _no_imu() -> tuple[IntArray, FloatArray, FloatArray]:
    return np.zeros(0, dtype=np.int64), np.zeros((0, 3)), np.zeros((0, 3))


def read_touched(path: Path, record: CalibrationRecord) -> tuple[TouchedPoint, ...]:
    """Return touched points; where a time is given, with the motors' readings of then.

    Raises:
        InputError: the file is malformed, or a time lies outside of the bag.
    """
    file = read_yaml(path, TouchedFile)
    result = []
    for number, point in enumerate(file.points):
        if point.q11 is not None and point.q21 is not None:
            angles = (point.q11, point.q21)
        else:
            time = point.time or 0.0
            if time > record.times[-1]:
                raise InputError(
                    f"{path}: points.{number}.time: {time:g} s: expected at most {record.times[-1]:.3f} s, the end"
                )
            q11, q21 = record.motors[int(np.argmin(np.abs(record.times - time)))].tolist()
            angles = (q11, q21)
        result.append(TouchedPoint(*angles, point.x, point.y, file.deviation_m))
    return tuple(result)
