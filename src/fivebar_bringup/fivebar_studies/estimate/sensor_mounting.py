# SPDX-License-Identifier: Apache-2.0
"""Names the sensor that is mounted, signed or scaled otherwise, where that explains a record that was rejected."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.scenario import Scenario
from fivebar_control.calibration.alternative_mountings import READINGS, AlternativeMounting, turned_gyroscope
from fivebar_control.calibration.record import CONTRADICTS
from fivebar_control.estimation.homing import HomingContradicted
from fivebar_control.estimation.late_reading import PASSIVE
from fivebar_description.interface import JOINTS
from fivebar_description.strict_yaml import InputError
from fivebar_studies.estimate.record import EstimatorRecord
from fivebar_studies.estimate.replay import Replay, estimated_again

AFTERWARDS = 1.0
"""Time (s) after the fault for which another reading of the record has to be consistent."""

CONSISTENT = 4.0
"""Largest mean square of the innovations, in units of their variance, of a reading that explains a record."""


def refuse_sensors_otherwise(record: EstimatorRecord, scenario: Scenario, bag: Path, replay: Replay | None) -> None:
    """Refuse a record that another mounting, sign or scale of a sensor explains.

    Args:
        record: what the estimator was given.
        scenario: of the run.
        bag: that has the record.
        replay: how the estimator took it; None where it contradicts the posture in which the robot starts.

    Raises:
        InputError: another reading does explain it; the text names the sensor that explains it best.
    """
    best = min(_explanations(record, scenario, bag, replay), default=None)
    if best is not None:
        raise InputError(f"{bag}: {CONTRADICTS}: {best[1]}")


def _explanations(
    record: EstimatorRecord, scenario: Scenario, bag: Path, replay: Replay | None
) -> Iterator[tuple[float, str]]:
    """Yield the misfit that is left with each other reading of a record, and the reading in words."""
    limit, some, rejected = CONSISTENT, record, replay is None
    if replay is not None:
        rejected = replay.faulted_at is not None
        if replay.faulted_at is None:
            limit = min(CONSISTENT, _misfit(replay))
        else:
            some = record.until(replay.faulted_at + round(AFTERWARDS * scenario.rate_hz))
    for words, other in _others(some, record, scenario, rejected):
        try:
            estimated = estimated_again(other, scenario, bag)
        except HomingContradicted:
            continue
        if not estimated.fault and _misfit(estimated) < limit:
            yield _misfit(estimated), words


def _others(
    some: EstimatorRecord, record: EstimatorRecord, scenario: Scenario, rejected: bool
) -> Iterator[tuple[str, EstimatorRecord]]:
    """Yield other readings of some of a record: of a gyroscope that is turned, and all if the record was rejected."""
    turned = turned_gyroscope(_velocities(record), scenario.imu.rotation()[2]) if scenario.gyro else ()
    for other in (*turned, *(READINGS if rejected else ())):
        if other.is_of_motors or scenario.gyro:
            yield other.words, _read(some, other)
    if rejected and scenario.passive.leg:
        joint = JOINTS[scenario.passive.place]
        words = f"the readings of {joint} have the opposite sign: its encoder counts backwards"
        backwards = [
            [reading._replace(value=-reading.value) if reading.sensor == PASSIVE else reading for reading in readings]
            for readings in some.late
        ]
        yield words, some._replace(late=backwards)


def _read(record: EstimatorRecord, other: AlternativeMounting) -> EstimatorRecord:
    changed = iter(other.gyroscope(_velocities(record)).tolist())
    return record._replace(
        angles=other.motors(record.angles),
        gyroscope=[[(made, tuple(next(changed))) for made, _ in readings] for readings in record.gyroscope],
    )


def _velocities(record: EstimatorRecord) -> FloatArray:
    """Return all angular velocities of the gyroscope, [m, 3] (rad/s)."""
    return np.array([value for readings in record.gyroscope for _, value in readings], dtype=np.float64).reshape(-1, 3)


def _misfit(replay: Replay) -> float:
    """Return the mean square of the innovations, of the sensor that fits the worst."""
    known = [values[np.isfinite(values)] for values in replay.squared.T]
    return max((float(np.mean(values)) for values in known if values.size), default=0.0)
