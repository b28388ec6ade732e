# SPDX-License-Identifier: Apache-2.0
"""The estimator's sequence of steps from sample to sample, as pure functions that the engine compiles as they stand.

First update, update, watch for frozen encoders, prediction over the drives' delay, test for ambiguity.
`StateEstimator` calls them for the node and the offline runner, and adds what is not the filter: missing commands,
gaps, latched faults, the check of homing.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from functools import cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.compiling import bound, bound_apart
from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.covariance import Matrix
from fivebar_control.estimation.ekf import Estimate, advanced, guessed, predicted
from fivebar_control.estimation.encoder import first_angle, next_angle, with_variance
from fivebar_control.estimation.extra_sensor import extra_taken
from fivebar_control.estimation.fault_numbers import ESTIMATE_AMBIGUOUS, ESTIMATE_INCONSISTENT, ESTIMATE_LOST
from fivebar_control.estimation.frozen import FrozenMemory, after_readings, named_fault
from fivebar_control.estimation.gyro_watch import gyro_fault, unheard
from fivebar_control.estimation.gyroscope import turn_rate
from fivebar_control.estimation.history import (
    IS_NEW,
    PERIODS,
    TAU1,
    TAU2,
    VALUE,
    angle_at,
    belief_at,
    empty_history,
    keep_angles,
    keep_belief,
    keep_inputs,
    row_of,
)
from fivebar_control.estimation.late_reading import EXTRA, GYROSCOPE, PASSIVE, SENSORS
from fivebar_control.estimation.late_sensors import effect_of, with_readings
from fivebar_control.estimation.measurements import corrected, homed_belief, motor_speeds
from fivebar_control.estimation.mirror import AmbiguityCheck, check_ambiguity
from fivebar_control.estimation.readings import (
    EstimatorMemory,
    Misfit,
    Pattern,
    Placed,
    after_encoders,
    after_estimate,
    after_gyro,
    approached,
    changed_memory,
    no_pattern,
    strain,
)
from fivebar_control.model.geometry import direct_geometry
from fivebar_control.model.kinematics import joints_of, state_from_platform
from fivebar_control.model.state import Joints
from fivebar_control.safety.stages import NO_FAULT
from fivebar_description.extra_sensor import ExtraSensor


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


def mean_square(squares: Matrix, sensor: int) -> float:
    """Return the mean of a late sensor's squared innovations, of sums and numbers in [SENSORS, 2]; NaN of none."""
    return float(squares[sensor, 0] / squares[sensor, 1]) if squares[sensor, 1] > 0.0 else math.nan


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
    angle1, angle2 = first_angle(model.resolution, q11), first_angle(model.resolution, q21)
    x, y = direct_geometry(model.filter.robot, assembly, angle1.value, angle2.value)
    belief = homed_belief(model.filter, x, y, angle1.variance + model.play)
    history = empty_history(model.history)
    keep_inputs(history, 0, 0, 0, 0.0, 0.0)
    keep_belief(history, 0, belief)
    misfit = Misfit(1.0, 1.0, 1.0, 1.0)
    return EstimatorMemory(
        belief, 0, q11, q21, q11, q21, 1, 1, math.nan, 1, 0, misfit, no_pattern(), unheard(), history
    )


class FilterFunctions(NamedTuple):
    """The functions of an estimator's filter that others call, by the names under which these know them."""

    first_update: Callable[..., EstimatorMemory]
    with_readings: Callable[..., Placed]
    estimator_step: Callable[..., EstimatorStep]


@cache
def filter_functions(extra: ExtraSensor | None) -> FilterFunctions:
    """Return the functions of a filter with a sensor from another package, or without; the same ones for the same."""
    if extra is None:
        return FilterFunctions(first_update, with_readings, estimator_step)
    taken = bound(extra_taken, extra_expected=extra.expected)
    update = bound(next_update, effect_of=bound(effect_of, extra_taken=taken))
    step = bound_apart(extra.expected.__name__, estimator_step, next_update=update)
    # copies, since the machine code of these functions that all filters share must not need the sensor's module
    return FilterFunctions(bound(first_update), bound(with_readings), step)


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
    complete = Prediction(ahead.memory, ahead.estimate, ahead.joints, ahead.lost, ahead.ambiguity, named.trip)
    return EstimatorStep(updated.squared, complete, named.memory)


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
    misfit, pattern = memory.misfit, memory.pattern
    by_encoders, squares = math.nan, np.zeros((SENSORS, 2))
    for entry in range(start, newest + 1):
        row = row_of(history, entry)
        inputs, late = history.inputs[row], history.late[row]
        has_rate = not math.isnan(late[GYROSCOPE, VALUE])
        tau1, tau2, gap = float(inputs[TAU1]), float(inputs[TAU2]), inputs[PERIODS] > 1.0
        rate_before = turn_rate(filter_model, belief.estimate) if has_rate else 0.0
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
        if has_rate:
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
            encoders = misfit.encoders + model.misfit_share * (by_encoders - misfit.encoders)
            misfit = Misfit(encoders, misfit.gyro, misfit.elbow, misfit.extra)
            pattern = after_encoders(model, pattern, by_angles.ahead1, by_angles.ahead2)
        for sensor in range(SENSORS):
            if math.isnan(late[sensor, VALUE]):
                continue
            effect = effect_of(model, belief, sensor, late[sensor], slope)
            belief = effect.belief
            # a late reading is taken again with each later one: only its first innovation counts
            if late[sensor, IS_NEW] > 0.0:
                squares[sensor, 0] += effect.misfit
                squares[sensor, 1] += 1.0
                misfit = approached(misfit, sensor, model.misfit_share, effect.misfit)
                if sensor == GYROSCOPE:
                    pattern = after_gyro(model, pattern, effect.ahead)
                late[sensor, IS_NEW] = 0.0
        keep_belief(history, entry, belief)
    pattern = after_estimate(model, pattern, belief, newest)
    changed = changed_memory(memory, belief, memory.near, misfit, pattern, memory.gyro)
    by_gyro, by_elbow = mean_square(squares, GYROSCOPE), mean_square(squares, PASSIVE)
    return Update(changed, expected, Misfit(by_encoders, by_gyro, by_elbow, mean_square(squares, EXTRA)))


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
    robot, mode = model.filter.robot, model.filter.mode
    joints = joints_of(state_from_platform(robot, mode, estimate.x, estimate.y, estimate.vx, estimate.vy))
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
        max(misfit.encoders, misfit.gyro, misfit.elbow, misfit.extra) <= model.misfit_limit
        and strain(model, pattern) <= 1.0
        and pattern.jump <= model.jump_limit
    )
