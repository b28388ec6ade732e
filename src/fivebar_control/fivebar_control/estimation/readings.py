# SPDX-License-Identifier: Apache-2.0
"""The estimator's memory, and how the motors' readings get into it."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.covariance import BIAS
from fivebar_control.estimation.ekf import Belief
from fivebar_control.estimation.encoder import repetitions
from fivebar_control.estimation.gyro_watch import GyroHeard, waited
from fivebar_control.estimation.history import (
    History,
    keep_inputs,
)
from fivebar_control.estimation.late_reading import EXTRA, GYROSCOPE, PASSIVE
from fivebar_description.tolerances import UNIFORM

LONGEST_GAP = 10
LONGEST_GAP_TIME = 0.02
"""Samples, and time (s), without a reading over which the filter predicts: the longer of both, as long as drives hold
their torque by default. After a longer gap the estimate is lost."""


LEAST_LEARNED = 0.01
"""Least share of a constant's variance that counts as learned."""


class Misfit(NamedTuple):
    """Recent means of the squared innovations in units of their variances, about 1 where the robot is as believed.

    Attributes:
        encoders: of the motor encoders.
        gyro: of the gyroscope.
        elbow: of the passive joint's encoder.
        extra: of a sensor from another package.
    """

    encoders: float
    gyro: float
    elbow: float
    extra: float


def approached(misfit: Misfit, sensor: int, share: float, square: float) -> Misfit:
    """Return the misfit after another squared innovation of a late sensor; `share` is its weight in the mean."""
    encoders, gyro, elbow, extra = misfit.encoders, misfit.gyro, misfit.elbow, misfit.extra
    if sensor == GYROSCOPE:
        gyro += share * (square - gyro)
    elif sensor == PASSIVE:
        elbow += share * (square - elbow)
    elif sensor == EXTRA:
        extra += share * (square - extra)
    return Misfit(encoders, gyro, elbow, extra)


class Trend(NamedTuple):
    """Recent means of a sensor's innovations in standard deviations: with their signs, and of their magnitudes.

    They reach back farther than the mean squares, so that what swings averages out.
    """

    offset: float
    size: float


class Pattern(NamedTuple):
    """How the innovations have come lately, at once, one-sided, or to and fro, and where they have led.

    Attributes:
        encoder1, encoder2, gyro: of the motor encoders and of the gyroscope.
        jump: largest innovation of a motor encoder in a single sample, in standard deviations, forgotten as the means
            forget.
        jumped: which motor's, 0 for none.
        error: largest constant error of robot and sensors as it is estimated, in units of its declared tolerance.
        bias: the gyroscope's as it is estimated, see `learned`.
    """

    encoder1: Trend
    encoder2: Trend
    gyro: Trend
    jump: float
    jumped: int
    error: float
    bias: float


def no_pattern() -> Pattern:
    """Return the pattern before the first innovation."""
    none = Trend(0.0, 0.0)
    return Pattern(none, none, none, 0.0, 0, 0.0, 0.0)


def gone_on(trend: Trend, share: float, ahead: float) -> Trend:
    """Return a trend after another innovation; `share` is its weight in the means."""
    return Trend(
        trend.offset + share * (ahead - trend.offset),
        trend.size + share * (abs(ahead) - trend.size),
    )


def after_encoders(model: EstimatorModel, pattern: Pattern, ahead1: float, ahead2: float) -> Pattern:
    """Return the pattern after both motor encoders' innovations."""
    share = model.offset_share
    jump, jumped = (1.0 - model.misfit_share) * pattern.jump, pattern.jumped
    if abs(ahead1) > jump:
        jump, jumped = abs(ahead1), 1
    if abs(ahead2) > jump:
        jump, jumped = abs(ahead2), 2
    encoder1, encoder2 = gone_on(pattern.encoder1, share, ahead1), gone_on(pattern.encoder2, share, ahead2)
    return Pattern(encoder1, encoder2, pattern.gyro, jump, jumped, pattern.error, pattern.bias)


def after_gyro(model: EstimatorModel, pattern: Pattern, ahead: float) -> Pattern:
    """Return the pattern after the gyroscope's innovation."""
    gyro = gone_on(pattern.gyro, model.offset_share, ahead)
    return Pattern(pattern.encoder1, pattern.encoder2, gyro, pattern.jump, pattern.jumped, pattern.error, pattern.bias)


def learned(estimate: float, before: float, now: float) -> float:
    """Return an estimated constant in standard deviations of what has been learned of it.

    An estimate that began at 0 with the variance `before`, and has the variance `now`, has itself that of their
    difference where all is as declared.
    """
    gone = max(before - now, LEAST_LEARNED * before)
    return abs(estimate) / math.sqrt(gone) if gone > 0.0 else 0.0


def after_estimate(model: EstimatorModel, pattern: Pattern, belief: Belief, samples: int) -> Pattern:
    """Return the pattern after an estimate of so many samples; errors taken for exactly known are left out."""
    known, estimate = model.filter, belief.estimate
    largest = 0.0
    for index in range(len(estimate.errors)):
        deviation = known.errors[index]
        if deviation > 0.0:
            largest = max(largest, abs(estimate.errors[index]) / (UNIFORM * deviation))
    walked = known.gyro_bias * known.gyro_bias + samples * known.noise.bias
    bias = learned(estimate.bias, walked, belief.covariance[BIAS, BIAS])
    return Pattern(pattern.encoder1, pattern.encoder2, pattern.gyro, pattern.jump, pattern.jumped, largest, bias)


def largest_offset(pattern: Pattern) -> float:
    """Return the largest recent mean of one sensor's innovations, in standard deviations."""
    return max(abs(pattern.encoder1.offset), abs(pattern.encoder2.offset), abs(pattern.gyro.offset))


def strain(model: EstimatorModel, pattern: Pattern) -> float:
    """Return offset, constant error and the gyroscope's bias together, 1 where one alone is at its limit.

    None alone tells a fault that the filter explains in part by errors of the robot and its sensors from what a sound
    robot makes of its vibrations, or of what the model lacks; these seldom have several at once.
    """
    errors = math.hypot(pattern.error / model.error_limit, pattern.bias / model.bias_limit)
    return math.hypot(largest_offset(pattern) / model.offset_limit, errors)


class EstimatorMemory(NamedTuple):
    """State of the estimator from sample to sample.

    Attributes:
        belief: at the moment of the last readings.
        newest: number of the last entry of the history.
        last1, last2: last readings (rad).
        before1, before2: readings before these (rad).
        repeated1, repeated2: samples for which the last ones have been the same.
        elbow: last reading of the passive joint's encoder (rad), NaN before the first.
        elbow_repeated: readings for which it has been the same.
        near: consecutive samples near the Type 2 locus.
        misfit: recent mean of the squared innovations.
        pattern: how they have come.
        gyro: what has been heard of the gyroscope.
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
    elbow: float
    elbow_repeated: int
    near: int
    misfit: Misfit
    pattern: Pattern
    gyro: GyroHeard
    history: History


def longest_gap(rate_hz: int) -> int:
    """Return after how many periods without a reading the estimate is still not lost."""
    return max(LONGEST_GAP, round(LONGEST_GAP_TIME * rate_hz))


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
        elbow=memory.elbow,
        elbow_repeated=memory.elbow_repeated,
        near=memory.near,
        misfit=memory.misfit,
        pattern=memory.pattern,
        gyro=waited(memory.gyro, periods),
        history=memory.history,
    )


class Placed(NamedTuple):
    """The memory with a late reading, and the entry of its history from which on `next_update` is to begin."""

    memory: EstimatorMemory
    start: int


def changed_memory(
    memory: EstimatorMemory, belief: Belief, near: int, misfit: Misfit, pattern: Pattern, gyro: GyroHeard
) -> EstimatorMemory:
    """Return a memory with another belief, number of samples near the locus, misfit, pattern and gyroscope."""
    return EstimatorMemory(
        belief,
        memory.newest,
        memory.last1,
        memory.last2,
        memory.before1,
        memory.before2,
        memory.repeated1,
        memory.repeated2,
        memory.elbow,
        memory.elbow_repeated,
        near,
        misfit,
        pattern,
        gyro,
        memory.history,
    )
