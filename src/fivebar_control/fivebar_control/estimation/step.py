"""The estimator's sequence of steps from sample to sample, as pure functions that the engine compiles as they stand.

First update, update, prediction over the drives' delay, test for ambiguity. `StateEstimator` calls them for the node
and the offline runner, and adds what is not the filter: missing commands, gaps, latched faults, the checks of homing
and of frozen encoders.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.estimation.ekf import (
    Belief,
    EkfSettings,
    Estimate,
    FilterModel,
    advanced,
    corrected,
    filter_model,
    homed_belief,
    motor_speeds,
    predicted,
)
from fivebar_control.estimation.encoder import count_angle, first_angle, next_angle, repetitions
from fivebar_control.estimation.mirror import AmbiguityCheck, AmbiguityLimits, check_ambiguity
from fivebar_control.model.geometry import direct_geometry
from fivebar_control.model.kinematics import joints_of, state_from_platform
from fivebar_control.model.state import Joints
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import as_numbers
from fivebar_description.shared_settings import DelaySamples, DriveTorqueLimit, EncoderCounts


class Drives(NamedTuple):
    """The estimator's model of the motors' encoders and drives."""

    encoder_counts: EncoderCounts = None
    delay_samples: DelaySamples = 0
    torque_limit: DriveTorqueLimit = None


class EstimatorModel(NamedTuple):
    """Constants of the estimator.

    Attributes:
        filter: constants of the Kalman filter.
        resolution: angle of an encoder's count (rad), 0 for exact encoders.
        rate_hz: samples per second.
        delay_samples: periods between a command and its effect.
        torque_limit: of the drives (Nm), infinite for none.
        limits: of the ambiguity test.
    """

    filter: FilterModel
    resolution: float
    rate_hz: int
    delay_samples: int
    torque_limit: float
    limits: AmbiguityLimits


class EstimatorMemory(NamedTuple):
    """State of the estimator from sample to sample.

    Attributes:
        belief: at the moment of the last readings.
        last1, last2: last readings (rad).
        repeated1, repeated2: samples for which they have been the same.
        near: consecutive samples near the Type 2 locus.
    """

    belief: Belief
    last1: float
    last2: float
    repeated1: int
    repeated2: int
    near: int


class Update(NamedTuple):
    """The memory after a sample's readings, and the estimate that was predicted for them."""

    memory: EstimatorMemory
    predicted: Estimate


class Prediction(NamedTuple):
    """Result of the estimator for a sample.

    Attributes:
        memory: for the next sample.
        estimate: when the answering torque begins to act.
        joints: of that estimate.
        lost: whether it is out of reach; the joints are then undefined, and ambiguity is not tested.
        ambiguity: whether the assembly mode is still known.
    """

    memory: EstimatorMemory
    estimate: Estimate
    joints: Joints
    lost: bool
    ambiguity: AmbiguityCheck


def estimator_model(
    robot: FiveBar, mode1: int, mode2: int, rate_hz: int, drives: Drives, settings: EkfSettings
) -> EstimatorModel:
    """Return the constants for a robot in a working mode at a sampling rate, each a number of one type."""
    numbers = as_numbers(settings)
    return EstimatorModel(
        filter=filter_model(robot, mode1, mode2, rate_hz, numbers),
        resolution=count_angle(drives.encoder_counts or 0),
        rate_hz=rate_hz,
        delay_samples=drives.delay_samples,
        torque_limit=math.inf if drives.torque_limit is None else float(drives.torque_limit),
        limits=AmbiguityLimits(numbers.mirror_deviations, numbers.dwell_limit),
    )


def first_update(model: EstimatorModel, assembly: int, q11: float, q21: float) -> EstimatorMemory:
    """Return the memory after the first readings (rad) of a robot at rest in an assembly mode."""
    one, two = first_angle(model.resolution, q11), first_angle(model.resolution, q21)
    x, y = direct_geometry(model.filter.robot, assembly, one.value, two.value)
    return EstimatorMemory(homed_belief(model.filter, x, y, one.variance), q11, q21, 1, 1, 0)


def next_update(
    model: EstimatorModel, memory: EstimatorMemory, periods: int, q11: float, q21: float, tau1: float, tau2: float
) -> Update:
    """Return the memory after further readings.

    Args:
        model: constants.
        memory: of the readings before.
        periods: since the readings before; more than one over a gap.
        q11, q21: readings (rad).
        tau1, tau2: torques (Nm) that were applied throughout these periods.
    """
    expected = memory.belief
    for _ in range(periods):
        expected = predicted(model.filter, expected, tau1, tau2)
    speed1, speed2 = motor_speeds(model.filter, expected.estimate)
    repeated1 = repetitions(memory.last1, memory.repeated1, q11)
    repeated2 = repetitions(memory.last2, memory.repeated2, q21)
    belief = corrected(
        model.filter,
        expected,
        next_angle(model.resolution, model.rate_hz, memory.last1, repeated1, q11, speed1),
        next_angle(model.resolution, model.rate_hz, memory.last2, repeated2, q21, speed2),
    )
    return Update(EstimatorMemory(belief, q11, q21, repeated1, repeated2, memory.near), expected.estimate)


def prediction(
    model: EstimatorModel,
    memory: EstimatorMemory,
    commands: Sequence[tuple[float, float]] | NDArray[np.float64],
    first: int,
) -> Prediction:
    """Return the result of the estimator for a sample.

    Args:
        model: constants.
        memory: after this sample's readings.
        commands: commanded torques (Nm), [n, 2]; those of sample k in row `k % n`.
        first: sample of the earliest command that does not act yet; `delay_samples` commands follow from it on.
    """
    estimate, limit = memory.belief.estimate, model.torque_limit
    for number in range(first, first + model.delay_samples):
        row = number % len(commands)
        tau1, tau2 = commands[row][0], commands[row][1]
        tau1, tau2 = max(-limit, min(limit, tau1)), max(-limit, min(limit, tau2))
        estimate = advanced(model.filter, estimate, tau1, tau2)
    robot, mode1, mode2 = model.filter.robot, model.filter.mode1, model.filter.mode2
    joints = joints_of(state_from_platform(robot, mode1, mode2, estimate.x, estimate.y, estimate.vx, estimate.vy))
    if not math.isfinite(joints.dq11 + joints.dq12 + joints.dq21 + joints.dq22):
        return Prediction(memory, estimate, joints, True, AmbiguityCheck(memory.near, math.inf, False))
    check = check_ambiguity(model.filter, model.limits, memory.near, memory.belief)
    kept = EstimatorMemory(memory.belief, memory.last1, memory.last2, memory.repeated1, memory.repeated2, check.near)
    return Prediction(kept, estimate, joints, False, check)
