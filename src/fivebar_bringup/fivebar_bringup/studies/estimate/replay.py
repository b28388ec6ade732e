"""A recorded run estimated again, and how consistent the estimate is."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from fivebar_bringup.runs.bag.recording import FloatArray
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.estimator import estimator_of
from fivebar_bringup.studies.estimate.record import EstimatorRecord
from fivebar_control.estimation.homing import HomingContradicted
from fivebar_control.model.kinematics import state_from_joints
from fivebar_description.parameters import FiveBar
from fivebar_description.strict_yaml import InputError


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


def estimated_again(record: EstimatorRecord, scenario: Scenario, source: Path) -> Replay:
    """Give what a recorded estimator was given to one with the settings of a scenario.

    Raises:
        InputError: the first reading is not that of the posture in which the robot was to start.
    """
    robot, estimator = scenario.five_bar(), estimator_of(scenario)
    count = len(record.samples)
    joints, squared = np.full((count, 8), math.nan), np.full((count, 3), math.nan)
    difference, error, position, velocity = (np.full(count, math.nan) for _ in range(4))
    same = True
    readings = np.hstack((record.angles, record.torques)).tolist()
    for row, sample in enumerate(record.samples.tolist()):
        q11, q21, tau1, tau2 = readings[row]
        for before in range(sample - scenario.plant.delay_samples, sample):
            if before in record.commands:
                estimator.commanded(before, *record.commands[before])
        rates = record.rates[row] if scenario.gyro else []
        try:
            estimate = estimator.take(sample, q11, q21, tau1, tau2, rates, record.elbows[row])
        except HomingContradicted as contradiction:
            raise InputError(f"{source}: {contradiction}") from contradiction
        joints[row] = (*estimate.position, *estimate.velocity)
        squared[row] = estimator.squared
        then = record.estimated.get(sample)
        if then is not None:
            same = same and then == tuple(joints[row].tolist())
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
    return Replay(time, joints, squared, difference, error, position, velocity, same, fault)


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
