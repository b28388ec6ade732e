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
    guessed,
    homed_belief,
    motor_speeds,
    predicted,
    turned,
)
from fivebar_control.estimation.encoder import count_angle, first_angle, next_angle, repetitions, with_variance
from fivebar_control.estimation.history import (
    PERIODS,
    RATE,
    TAU1,
    TAU2,
    History,
    angle_at,
    belief_at,
    empty_history,
    keep_angles,
    keep_belief,
    keep_inputs,
    keep_rate,
    row_of,
)
from fivebar_control.estimation.mirror import AmbiguityCheck, AmbiguityLimits, check_ambiguity
from fivebar_control.model.geometry import direct_geometry
from fivebar_control.model.kinematics import joints_of, state_from_platform
from fivebar_control.model.state import Joints
from fivebar_description.imu import LONGEST_LATENCY
from fivebar_description.parameters import FiveBar
from fivebar_description.settings import as_numbers
from fivebar_description.shared_settings import DelaySamples, DriveTorqueLimit, EncoderCounts
from fivebar_description.tolerances import EXACT, Tolerances


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
        play: variance of the angle between a motor and its link (rad^2).
        rate_hz: samples per second.
        delay_samples: periods between a command and its effect.
        torque_limit: of the drives (Nm), infinite for none.
        limits: of the ambiguity test.
        misfit_share: weight of a sample in the mean of the squared innovations.
        misfit_limit: of that mean.
        history: samples that are kept for late readings.
    """

    filter: FilterModel
    resolution: float
    play: float
    rate_hz: int
    delay_samples: int
    torque_limit: float
    limits: AmbiguityLimits
    misfit_share: float
    misfit_limit: float
    history: int


class Misfit(NamedTuple):
    """Recent means of the squared innovations in units of their variances, about 1 where the robot is as believed.

    Attributes:
        encoders: of the motor encoders.
        gyro: of the gyroscope.
    """

    encoders: float
    gyro: float


class EstimatorMemory(NamedTuple):
    """State of the estimator from sample to sample.

    Attributes:
        belief: at the moment of the last readings.
        newest: number of the last entry of the history.
        last1, last2: last readings (rad).
        before1, before2: readings before these (rad).
        repeated1, repeated2: samples for which the last ones have been the same.
        near: consecutive samples near the Type 2 locus.
        misfit: recent mean of the squared innovations.
        history: of the last samples, changed in place.
    """

    belief: Belief
    newest: int
    last1: float
    last2: float
    before1: float
    before2: float
    repeated1: int
    repeated2: int
    near: int
    misfit: Misfit
    history: History


class Update(NamedTuple):
    """Result of a sample's readings.

    Attributes:
        memory: after them.
        predicted: the estimate that was predicted for them.
        squared: mean of the squared innovations of this sample's readings in units of their variances; NaN without one.
    """

    memory: EstimatorMemory
    predicted: Estimate
    squared: Misfit


class Prediction(NamedTuple):
    """Result of the estimator for a sample.

    Attributes:
        memory: for the next sample.
        estimate: when the answering torque begins to act.
        joints: of that estimate.
        lost: whether it is out of reach; the joints are then undefined, and ambiguity is not tested.
        ambiguity: whether the assembly mode is still known.
        inconsistent: whether the measurements contradict the model by more than all declared uncertainty.
    """

    memory: EstimatorMemory
    estimate: Estimate
    joints: Joints
    lost: bool
    ambiguity: AmbiguityCheck
    inconsistent: bool


def estimator_model(
    robot: FiveBar,
    mode1: int,
    mode2: int,
    rate_hz: int,
    drives: Drives,
    settings: EkfSettings,
    tolerances: Tolerances = EXACT,
) -> EstimatorModel:
    """Return the constants for a robot in a working mode at a sampling rate, each a number of one type."""
    numbers = as_numbers(settings)
    return EstimatorModel(
        filter=filter_model(robot, mode1, mode2, rate_hz, numbers, as_numbers(tolerances)),
        resolution=count_angle(drives.encoder_counts or 0),
        play=numbers.play * numbers.play,
        rate_hz=rate_hz,
        delay_samples=drives.delay_samples,
        torque_limit=math.inf if drives.torque_limit is None else float(drives.torque_limit),
        limits=AmbiguityLimits(numbers.mirror_deviations, numbers.dwell_limit),
        misfit_share=1.0 - math.exp(-1.0 / (rate_hz * numbers.misfit_time)),
        misfit_limit=numbers.misfit_limit,
        history=history_samples(rate_hz) if settings.gyro else 2,
    )


def history_samples(rate_hz: int) -> int:
    """Return how many samples are kept, so that readings that are `LONGEST_LATENCY` late still find theirs."""
    return math.ceil(LONGEST_LATENCY * rate_hz) + 2


def first_update(model: EstimatorModel, assembly: int, q11: float, q21: float) -> EstimatorMemory:
    """Return the memory after the first readings (rad), those of sample 0, of a robot at rest in an assembly mode."""
    one, two = first_angle(model.resolution, q11), first_angle(model.resolution, q21)
    x, y = direct_geometry(model.filter.robot, assembly, one.value, two.value)
    belief = homed_belief(model.filter, x, y, one.variance + model.play)
    history = empty_history(model.history)
    keep_inputs(history, 0, 0, 0, 0.0, 0.0)
    keep_belief(history, 0, belief)
    return EstimatorMemory(belief, 0, q11, q21, q11, q21, 1, 1, 0, Misfit(1.0, 1.0), history)


def with_motors(
    memory: EstimatorMemory, sample: int, periods: int, q11: float, q21: float, tau1: float, tau2: float
) -> EstimatorMemory:
    """Return the memory with further motor readings, to be taken by `next_update`.

    Args:
        memory: of the readings before.
        sample: of the readings.
        periods: since the readings before; more than one over a gap.
        q11, q21: readings (rad).
        tau1, tau2: torques (Nm) that were applied throughout these periods.
    """
    newest = memory.newest + 1
    keep_inputs(memory.history, newest, sample, periods, tau1, tau2)
    return EstimatorMemory(
        belief=memory.belief,
        newest=newest,
        last1=q11,
        last2=q21,
        before1=memory.last1,
        before2=memory.last2,
        repeated1=repetitions(memory.last1, memory.repeated1, q11),
        repeated2=repetitions(memory.last2, memory.repeated2, q21),
        near=memory.near,
        misfit=memory.misfit,
        history=memory.history,
    )


def with_rate(memory: EstimatorMemory, sample: int, rate: float) -> int:
    """Add a gyroscope reading (rad/s) of a sample, and return from which entry on `next_update` is to begin.

    A reading of sample 0, or of one that is no longer in the history, is left out.
    """
    return keep_rate(memory.history, memory.newest, sample, rate)


def next_update(model: EstimatorModel, memory: EstimatorMemory, start: int) -> Update:
    """Return the memory after the newest motor readings, and the gyroscope's.

    Args:
        model: constants.
        memory: with readings that have not been taken yet.
        start: first entry of the history to be worked out; the newest one where no late reading has come.
    """
    filter_model, history, newest = model.filter, memory.history, memory.newest
    belief = belief_at(history, start - 1)
    expected = belief.estimate
    encoders, gyro = memory.misfit.encoders, memory.misfit.gyro
    by_encoders = by_gyro = math.nan
    for entry in range(start, newest + 1):
        inputs = history.inputs[row_of(history, entry)]
        tau1, tau2, gap = float(inputs[TAU1]), float(inputs[TAU2]), inputs[PERIODS] > 1.0
        before1, before2 = motor_speeds(filter_model, belief.estimate) if entry == newest else (0.0, 0.0)
        if gap:
            # the torque of one of these periods is known, and not of which: between it and the one before the gap
            inputs_before = history.inputs[row_of(history, entry - 1)]
            doubt1, doubt2 = tau1 - float(inputs_before[TAU1]), tau2 - float(inputs_before[TAU2])
            for _ in range(int(inputs[PERIODS])):
                belief = guessed(filter_model, belief, tau1, tau2, doubt1, doubt2)
        else:
            belief = predicted(filter_model, belief, tau1, tau2)
        if entry == newest:
            expected = belief.estimate
            speed1, speed2 = motor_speeds(filter_model, expected)
            # a motor that turns back within the period has gone farther than its speed at the end tells
            largest1, largest2 = max(abs(before1), abs(speed1)), max(abs(before2), abs(speed2))
            q11 = next_angle(model.resolution, model.rate_hz, memory.before1, memory.repeated1, memory.last1, largest1)
            q21 = next_angle(model.resolution, model.rate_hz, memory.before2, memory.repeated2, memory.last2, largest2)
            keep_angles(history, entry, with_variance(q11, model.play), with_variance(q21, model.play))
        q11, q21 = angle_at(history, entry, 1), angle_at(history, entry, 2)
        if gap:
            # the answer to the sample that is missing may have come late, and been taken for that to this one
            speed1, speed2 = motor_speeds(filter_model, belief.estimate)
            late1, late2 = speed1 / model.rate_hz, speed2 / model.rate_hz
            q11, q21 = with_variance(q11, late1 * late1), with_variance(q21, late2 * late2)
        by_angles = corrected(filter_model, belief, q11, q21)
        belief = by_angles.belief
        if entry == newest:
            by_encoders = 0.5 * by_angles.misfit
            encoders += model.misfit_share * (by_encoders - encoders)
        if not math.isnan(inputs[RATE]):
            by_rate = turned(filter_model, belief, float(inputs[RATE]))
            belief = by_rate.belief
            # a late reading is taken again with each later one: only its first innovation counts
            if entry == start:
                by_gyro = by_rate.misfit
                gyro += model.misfit_share * (by_gyro - gyro)
        keep_belief(history, entry, belief)
    changed = changed_memory(memory, belief, memory.near, Misfit(encoders, gyro))
    return Update(changed, expected, Misfit(by_encoders, by_gyro))


def changed_memory(memory: EstimatorMemory, belief: Belief, near: int, misfit: Misfit) -> EstimatorMemory:
    """Return a memory with another belief, number of samples near the locus, and misfit."""
    return EstimatorMemory(
        belief,
        memory.newest,
        memory.last1,
        memory.last2,
        memory.before1,
        memory.before2,
        memory.repeated1,
        memory.repeated2,
        near,
        misfit,
        memory.history,
    )


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
        return Prediction(memory, estimate, joints, True, AmbiguityCheck(memory.near, math.inf, False), False)
    check = check_ambiguity(model.filter, model.limits, memory.near, memory.belief)
    kept = changed_memory(memory, memory.belief, check.near, memory.misfit)
    # NaN counts as inconsistent
    inconsistent = not max(memory.misfit.encoders, memory.misfit.gyro) <= model.misfit_limit
    return Prediction(kept, estimate, joints, False, check, inconsistent)


def inconsistency_reason(model: EstimatorModel, misfit: Misfit) -> str:
    """Return in words why an estimate is inconsistent."""
    by_gyro = misfit.gyro > misfit.encoders
    mean = misfit.gyro if by_gyro else misfit.encoders
    return (
        f"{'the gyroscope' if by_gyro else 'the motor encoders'} differ{'s' if by_gyro else ''} from the predictions by"
        f" {math.sqrt(mean):.1f} standard deviations, limit {math.sqrt(model.misfit_limit):.1f}: check the robot's"
        " geometry and zeros against `tolerances`, and the sensor"
    )
