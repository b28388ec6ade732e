# SPDX-License-Identifier: Apache-2.0
"""The estimator's sequence of steps from sample to sample, as pure functions that the engine compiles as they stand.

First update, update, watch for frozen encoders, prediction over the drives' delay, test for ambiguity.
`StateEstimator` calls them for the node and the offline runner, and adds what is not the filter: missing commands,
gaps, latched faults, the check of homing.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.ekf import Estimate, advanced, guessed, predicted
from fivebar_control.estimation.encoder import Angle, first_angle, next_angle, with_variance
from fivebar_control.estimation.frozen import FrozenMemory, after_readings, named_fault
from fivebar_control.estimation.gyro_watch import gyro_fault, unheard
from fivebar_control.estimation.history import (
    ELBOW,
    ELBOW_IS_NEW,
    ELBOW_VARIANCE,
    LAG,
    PERIODS,
    RATE,
    RATE_IS_NEW,
    SEEN_LAG,
    SEEN_VARIANCE,
    SEEN_X,
    SEEN_Y,
    TAU1,
    TAU2,
    angle_at,
    belief_at,
    empty_history,
    keep_angles,
    keep_belief,
    keep_inputs,
    row_of,
)
from fivebar_control.estimation.measurements import (
    CAMERA_GATE,
    corrected,
    elbow_turned,
    homed_belief,
    motor_speeds,
    seen_at,
    turn_rate,
    turned,
)
from fivebar_control.estimation.mirror import AmbiguityCheck, check_ambiguity
from fivebar_control.estimation.readings import (
    EstimatorMemory,
    Misfit,
    Pattern,
    after_encoders,
    after_estimate,
    after_gyro,
    changed_memory,
    no_pattern,
    strain,
)
from fivebar_control.estimation.trips import ESTIMATE_AMBIGUOUS, ESTIMATE_INCONSISTENT, ESTIMATE_LOST
from fivebar_control.model.geometry import direct_geometry
from fivebar_control.model.kinematics import joints_of, state_from_platform
from fivebar_control.model.state import Joints
from fivebar_control.safety.stages import NO_FAULT


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


class Mean(NamedTuple):
    """Sum and number of some values."""

    total: float
    number: int


def mean_of(values: Mean) -> float:
    """Return the mean, NaN of no values."""
    return values.total / values.number if values.number > 0 else math.nan


class Prediction(NamedTuple):
    """Result of the estimator for a sample.

    Attributes:
        memory: for the next sample.
        estimate: when the answering torque begins to act.
        joints: of that estimate.
        lost: whether it is out of reach; the joints are then undefined, and ambiguity is not tested.
        ambiguity: whether the assembly mode is still known.
        trip: number of the fault that this is, see `trips`; `NO_FAULT` for none.
    """

    memory: EstimatorMemory
    estimate: Estimate
    joints: Joints
    lost: bool
    ambiguity: AmbiguityCheck
    trip: int


class EstimatorStep(NamedTuple):
    """Result of a sample: of the update by its readings, and of the prediction from there.

    Attributes:
        squared: as in `Update`.
        prediction: over the drives' delay.
        frozen: what the watch for frozen encoders has seen.
    """

    squared: Misfit
    prediction: Prediction
    frozen: FrozenMemory


def first_update(model: EstimatorModel, assembly: int, q11: float, q21: float) -> EstimatorMemory:
    """Return the memory after the first readings (rad), those of sample 0, of a robot at rest in an assembly mode."""
    one, two = first_angle(model.resolution, q11), first_angle(model.resolution, q21)
    x, y = direct_geometry(model.filter.robot, assembly, one.value, two.value)
    belief = homed_belief(model.filter, x, y, one.variance + model.play)
    history = empty_history(model.history)
    keep_inputs(history, 0, 0, 0, 0.0, 0.0)
    keep_belief(history, 0, belief)
    return EstimatorMemory(
        belief, 0, q11, q21, q11, q21, 1, 1, math.nan, 1, 0, Misfit(1.0, 1.0, 1.0), no_pattern(), unheard(), history
    )


def estimator_step(
    model: EstimatorModel,
    memory: EstimatorMemory,
    frozen: FrozenMemory,
    start: int,
    commands: Sequence[tuple[float, float]] | NDArray[np.float64],
    first: int,
    coasts: bool,
) -> EstimatorStep:
    """Return the result of the estimator for a sample: `next_update`, `after_readings`, `prediction`, `named_fault`.

    All in one call, since to hand over the constants to machine code takes as long as any of them. After the first
    readings there is nothing to update, and `start` is 1. `coasts` says whether no torque is commanded any more.
    """
    updated = next_update(model, memory, start)
    if start <= memory.newest:
        gap = memory.history.inputs[row_of(memory.history, memory.newest), PERIODS] > 1.0
        frozen = after_readings(model, frozen, memory.last1, memory.last2, updated.predicted, gap, coasts)
    ahead = prediction(model, updated.memory, commands, first)
    named = named_fault(model, ahead.trip, frozen, ahead.memory.gyro)
    found = Prediction(ahead.memory, ahead.estimate, ahead.joints, ahead.lost, ahead.ambiguity, named.trip)
    return EstimatorStep(updated.squared, found, named.memory)


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
    encoders, gyro, elbow = memory.misfit.encoders, memory.misfit.gyro, memory.misfit.elbow
    pattern = memory.pattern
    by_encoders, by_gyro, by_elbow = math.nan, Mean(0.0, 0), Mean(0.0, 0)
    for entry in range(start, newest + 1):
        inputs = history.inputs[row_of(history, entry)]
        tau1, tau2, gap = float(inputs[TAU1]), float(inputs[TAU2]), inputs[PERIODS] > 1.0
        rate_before = turn_rate(filter_model, belief.estimate) if not math.isnan(inputs[RATE]) else 0.0
        before1, before2 = motor_speeds(filter_model, belief.estimate) if entry == newest else (0.0, 0.0)
        if gap:
            # the torque of one of these periods is known, and not of which: between it and the one before the gap
            inputs_before = history.inputs[row_of(history, entry - 1)]
            doubt1, doubt2 = tau1 - float(inputs_before[TAU1]), tau2 - float(inputs_before[TAU2])
            for _ in range(int(inputs[PERIODS])):
                belief = guessed(filter_model, belief, tau1, tau2, doubt1, doubt2)
        else:
            belief = predicted(filter_model, belief, tau1, tau2)
        slope = 0.0
        if not math.isnan(inputs[RATE]):
            slope = (turn_rate(filter_model, belief.estimate) - rate_before) / (
                float(inputs[PERIODS]) * filter_model.period
            )
        if entry == newest:
            expected = belief.estimate
            speed1, speed2 = motor_speeds(filter_model, expected)
            # a motor that turns back within the period has gone farther than its speed at the end says
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
            pattern = after_encoders(model, pattern, by_angles.ahead1, by_angles.ahead2)
        # a late reading is taken again with each later one: only its first innovation counts
        if not math.isnan(inputs[ELBOW]):
            reading = Angle(float(inputs[ELBOW]), float(inputs[ELBOW_VARIANCE]))
            by_angle = elbow_turned(filter_model, belief, model.elbow, reading)
            belief = by_angle.belief
            if inputs[ELBOW_IS_NEW] > 0.0:
                by_elbow = Mean(by_elbow.total + by_angle.misfit, by_elbow.number + 1)
                elbow += model.misfit_share * (by_angle.misfit - elbow)
                inputs[ELBOW_IS_NEW] = 0.0
        if not math.isnan(inputs[RATE]):
            by_rate = turned(filter_model, belief, float(inputs[RATE]), float(inputs[LAG]), slope)
            belief = by_rate.belief
            if inputs[RATE_IS_NEW] > 0.0:
                by_gyro = Mean(by_gyro.total + by_rate.misfit, by_gyro.number + 1)
                gyro += model.misfit_share * (by_rate.misfit - gyro)
                pattern = after_gyro(model, pattern, by_rate.ahead)
                inputs[RATE_IS_NEW] = 0.0
        if not math.isnan(inputs[SEEN_X]):
            x, y, lag = float(inputs[SEEN_X]), float(inputs[SEEN_Y]), float(inputs[SEEN_LAG])
            belief = seen_at(belief, x, y, lag, float(inputs[SEEN_VARIANCE]), CAMERA_GATE).belief
        keep_belief(history, entry, belief)
    pattern = after_estimate(model, pattern, belief.estimate)
    changed = changed_memory(memory, belief, memory.near, Misfit(encoders, gyro, elbow), pattern, memory.gyro)
    return Update(changed, expected, Misfit(by_encoders, mean_of(by_gyro), mean_of(by_elbow)))


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
        return Prediction(memory, estimate, joints, True, AmbiguityCheck(memory.near, math.inf, False), ESTIMATE_LOST)
    check = check_ambiguity(model.filter, model.limits, memory.near, memory.belief)
    kept = changed_memory(memory, memory.belief, check.near, memory.misfit, memory.pattern, memory.gyro)
    misfit, trip = memory.misfit, NO_FAULT
    if model.gyro:
        trip = gyro_fault(memory.gyro, model.gyro_silence, model.filter.gyro_noise)
    if trip == NO_FAULT and check.ambiguous:
        trip = ESTIMATE_AMBIGUOUS
    if trip == NO_FAULT and not is_consistent(model, misfit, memory.pattern):
        trip = ESTIMATE_INCONSISTENT
    return Prediction(kept, estimate, joints, False, check, trip)


def is_consistent(model: EstimatorModel, misfit: Misfit, pattern: Pattern) -> bool:
    """Return whether the innovations are within all limits; NaN is not."""
    return (
        max(misfit.encoders, misfit.gyro, misfit.elbow) <= model.misfit_limit
        and strain(model, pattern) <= 1.0
        and pattern.jump <= model.jump_limit
    )
