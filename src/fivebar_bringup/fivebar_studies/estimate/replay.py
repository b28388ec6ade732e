# SPDX-License-Identifier: Apache-2.0
"""A recorded run estimated again, and how consistent the estimate is."""

from __future__ import annotations

import math
from copy import deepcopy
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.scenario import Scenario
from fivebar_control.controller.estimator import estimator_of
from fivebar_control.estimation.estimator import JointEstimate, StateEstimator
from fivebar_control.estimation.homing import HomingContradicted
from fivebar_control.estimation.late_reading import CAMERA, GYROSCOPE, LateReading
from fivebar_control.estimation.readings import Misfit
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.planning.program_run import SETTLING
from fivebar_description.parameters import FiveBar, laden
from fivebar_studies.estimate.record import EstimatorRecord

SEARCHED = 2.0 * SETTLING
"""Time (s) before and after the moment at which a payload was logged, within which the recorded estimator took it."""


class Replay(NamedTuple):
    """A run that was estimated again; NaN where there is nothing.

    Attributes:
        time: float64[n] (s).
        joints: float64[n, 8], as published: four angles (rad) and four speeds (rad/s).
        squared: float64[n, 3], mean squared innovations of encoders, gyroscope and passive joint's encoder in units of
            variance.
        difference: float64[n], distance (m) of the estimated platform from the recorded estimate.
        error: float64[n], distance (m) of the platform as estimated at the measurement from the exact one.
        position, velocity: float64[n], normalised squared errors (NEES), 2 expected of each.
        same: whether every joint state equals the recorded one, bit for bit.
        fault: the first, empty for none.
        faulted_at: row of the readings at which it was found, None for none.
    """

    time: FloatArray
    joints: FloatArray
    squared: FloatArray
    difference: FloatArray
    error: FloatArray
    position: FloatArray
    velocity: FloatArray
    same: bool
    fault: str
    faulted_at: int | None = None

    def as_json(self) -> dict[str, Any]:
        """Return the figures as plain values; None where there is none."""
        return {
            "samples": len(self.time),
            "innovations_encoders": _mean(self.squared[:, 0]),
            "innovations_encoders_max": _largest(self.squared[:, 0]),
            "innovations_gyro": _mean(self.squared[:, 1]),
            "innovations_gyro_max": _largest(self.squared[:, 1]),
            "innovations_elbow": _mean(self.squared[:, 2]),
            "innovations_elbow_max": _largest(self.squared[:, 2]),
            "nees_position": _mean(self.position),
            "nees_velocity": _mean(self.velocity),
            "estimate_error_max_m": _largest(self.error),
            "difference_max_m": _largest(self.difference),
            "identical": self.same,
            "fault": self.fault,
        }


def with_payloads_as_taken(record: EstimatorRecord, scenario: Scenario, source: Path) -> EstimatorRecord:
    """Return a record with each payload at the row at which the recorded estimator took it.

    A payload's message has no stamp, and reaches recorder and estimator at different times. The row is therefore that
    at which the recorded estimate can no longer be had without the payload, with the settings of the run. Where it
    cannot be had with the payload either, as of a real robot, the payload stays where it was logged.

    Raises:
        HomingContradicted: the first reading is not that of the posture in which the robot was to start.
    """
    estimator, searched = estimator_of(scenario), round(SEARCHED * scenario.rate_hz)
    placed, row = record._replace(payloads={}), 0
    for logged, payload in record.payloads.items():
        while row < logged - searched:
            _estimate(placed, scenario, source, estimator, row)
            row += 1
        last = min(logged + searched, len(record.samples) - 1)
        first = _first_with(placed, scenario, source, deepcopy(estimator), row, last, payload)
        placed.payloads[logged if first is None else first] = payload
    return placed


def _first_with(
    record: EstimatorRecord,
    scenario: Scenario,
    source: Path,
    estimator: StateEstimator,
    begin: int,
    last: int,
    payload: float,
) -> int | None:
    """Return the row from `begin` to `last` at which a payload (kg) was taken, None where that cannot be told."""
    for row in range(begin, last + 1):
        laden_from_here = deepcopy(estimator)
        if not _same(record, row, _estimate(record, scenario, source, estimator, row)):
            with_it = record._replace(payloads={row: payload})
            sample = _same(record, row, _estimate(with_it, scenario, source, laden_from_here, row))
            return row if sample else None
    return None


def _estimate(
    record: EstimatorRecord, scenario: Scenario, source: Path, estimator: StateEstimator, row: int
) -> JointEstimate:
    """Give an estimator what the recorded one was given for a row, and return its answer."""
    if row in record.payloads:
        estimator.carry(laden(scenario.five_bar(), record.payloads[row]))
    sample = int(record.samples[row])
    for before in range(sample - scenario.plant.delay_samples, sample):
        if before in record.commands:
            estimator.commanded(before, *record.commands[before])
    (q11, q21), (tau1, tau2) = record.angles[row].tolist(), record.torques[row].tolist()
    readings = [reading for reading in record.late[row] if scenario.sees or reading.sensor != CAMERA]
    if scenario.gyro:
        usable_rate = scenario.imu.usable_rate
        readings += [LateReading(GYROSCOPE, made, usable_rate(reading)) for made, reading in record.gyroscope[row]]
    try:
        return estimator.take(sample, q11, q21, tau1, tau2, readings)
    except HomingContradicted as contradiction:
        raise HomingContradicted(f"{source}: {contradiction}") from contradiction


def _same(record: EstimatorRecord, row: int, estimate: JointEstimate) -> bool:
    """Return whether an estimate equals the recorded one, bit for bit, as far as there is one."""
    then = record.estimated.get(int(record.samples[row]))
    return then is None or then == (*estimate.position, *estimate.velocity)


def estimated_again(record: EstimatorRecord, scenario: Scenario, source: Path) -> Replay:
    """Give what a recorded estimator was given to one with the settings of a scenario.

    Raises:
        HomingContradicted: the first reading is not that of the posture in which the robot was to start.
    """
    robot, estimator = scenario.five_bar(), estimator_of(scenario)
    count = len(record.samples)
    joints, squared = np.full((count, 8), math.nan), np.full((count, len(Misfit._fields)), math.nan)
    difference, error, position, velocity = (np.full(count, math.nan) for _ in range(4))
    same, faulted_at = True, None
    for row, sample in enumerate(record.samples.tolist()):
        estimate = _estimate(record, scenario, source, estimator, row)
        joints[row] = (*estimate.position, *estimate.velocity)
        squared[row] = estimator.squared
        if estimator.fault is not None and faulted_at is None:
            faulted_at = row
        same = same and _same(record, row, estimate)
        then = record.estimated.get(sample)
        if then is not None:
            difference[row] = math.dist(_place(robot, then), _place(robot, tuple(joints[row].tolist())))
        if sample in record.truth and estimator.belief is not None:
            state = state_from_joints(robot, *record.truth[sample])
            believed, covariance = estimator.belief
            off = np.array([believed.x - state.x, believed.y - state.y, believed.vx - state.vx, believed.vy - state.vy])
            error[row] = math.hypot(off[0], off[1])
            position[row] = _normalised(off[:2], covariance[:2, :2])
            velocity[row] = _normalised(off[2:], covariance[2:4, 2:4])
    time = record.samples / scenario.rate_hz
    fault = "" if estimator.fault is None else str(estimator.fault)
    return Replay(time, joints, squared, difference, error, position, velocity, same, fault, faulted_at)


def _place(robot: FiveBar, joints: tuple[float, ...]) -> tuple[float, float]:
    state = state_from_joints(robot, *joints)
    return state.x, state.y


def _normalised(error: FloatArray, covariance: FloatArray) -> float:
    """Return e^T P^-1 e; NaN where the covariance has no inverse."""
    determinant = covariance[0, 0] * covariance[1, 1] - covariance[0, 1] * covariance[1, 0]
    return float(error @ np.linalg.solve(covariance, error)) if determinant > 0.0 else math.nan


def _mean(values: FloatArray) -> float | None:
    finite = values[np.isfinite(values)]
    return float(np.mean(finite)) if finite.size else None


def _largest(values: FloatArray) -> float | None:
    finite = values[np.isfinite(values)]
    return float(np.max(finite)) if finite.size else None
