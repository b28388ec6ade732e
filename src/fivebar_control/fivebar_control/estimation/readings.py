# SPDX-License-Identifier: Apache-2.0
"""The estimator's memory, and how readings get into it: of the motors, and late ones of gyroscope, joint and camera."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.ekf import Belief, Estimate
from fivebar_control.estimation.encoder import Angle, first_angle, next_angle, repetitions
from fivebar_control.estimation.gyro_watch import GyroHeard, not_used, used, waited
from fivebar_control.estimation.history import (
    SAMPLE,
    History,
    belief_at,
    entry_of,
    keep_elbow,
    keep_inputs,
    keep_rate,
    keep_seen,
    row_of,
)
from fivebar_control.estimation.measurements import elbow_speed, turn_rate
from fivebar_description.tolerances import UNIFORM

Readings = Sequence[Sequence[float]] | NDArray[np.float64]
"""Readings of a late sensor, each with the moment of its stamp in samples and its values."""

LONGEST_GAP = 10
LONGEST_GAP_TIME = 0.02
"""Samples, and time (s), without a reading over which the filter predicts: the longer of both, as long as drives hold
their torque by default. After a longer gap the estimate is lost."""

EARLIEST = 0.02
"""Time (s) by which the stamp of a reading may be ahead of the newest sample: beyond it, its clock is wrong."""


class Misfit(NamedTuple):
    """Recent means of the squared innovations in units of their variances, about 1 where the robot is as believed.

    Attributes:
        encoders: of the motor encoders.
        gyro: of the gyroscope.
        elbow: of the passive joint's encoder.
    """

    encoders: float
    gyro: float
    elbow: float


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
    """

    encoder1: Trend
    encoder2: Trend
    gyro: Trend
    jump: float
    jumped: int
    error: float


def no_pattern() -> Pattern:
    """Return the pattern before the first innovation."""
    none = Trend(0.0, 0.0)
    return Pattern(none, none, none, 0.0, 0, 0.0)


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
    one, two = gone_on(pattern.encoder1, share, ahead1), gone_on(pattern.encoder2, share, ahead2)
    return Pattern(one, two, pattern.gyro, jump, jumped, pattern.error)


def after_gyro(model: EstimatorModel, pattern: Pattern, ahead: float) -> Pattern:
    """Return the pattern after the gyroscope's innovation."""
    gyro = gone_on(pattern.gyro, model.offset_share, ahead)
    return Pattern(pattern.encoder1, pattern.encoder2, gyro, pattern.jump, pattern.jumped, pattern.error)


def after_estimate(model: EstimatorModel, pattern: Pattern, estimate: Estimate) -> Pattern:
    """Return the pattern after an estimate; errors that are taken for exactly known are left out."""
    largest = 0.0
    for index in range(len(estimate.errors)):
        deviation = model.filter.errors[index]
        if deviation > 0.0:
            largest = max(largest, abs(estimate.errors[index]) / (UNIFORM * deviation))
    return Pattern(pattern.encoder1, pattern.encoder2, pattern.gyro, pattern.jump, pattern.jumped, largest)


def largest_offset(pattern: Pattern) -> float:
    """Return the largest recent mean of one sensor's innovations, in standard deviations."""
    return max(abs(pattern.encoder1.offset), abs(pattern.encoder2.offset), abs(pattern.gyro.offset))


def strain(model: EstimatorModel, pattern: Pattern) -> float:
    """Return the largest offset and the largest constant error together, 1 where either alone is at its limit.

    Neither alone tells a fault that the filter explains in part by an error of the robot from what a sound robot
    makes of its vibrations, or of what the model lacks; these seldom have both at once.
    """
    return math.hypot(largest_offset(pattern) / model.offset_limit, pattern.error / model.error_limit)


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


def with_rate(model: EstimatorModel, memory: EstimatorMemory, made: float, rate: float) -> Placed:
    """Add a gyroscope reading (rad/s).

    It is put at the first sample at or after the moment at which it was made, by what is known and estimated of its
    clock, and at the newest one at the latest. A reading of sample 0, or of one that is no longer in the history, is
    left out, and so is an infinite one, at the end of its range, or one whose stamp is far ahead of the newest sample,
    and so are all once the estimate is lost for good, NaN in all that it has.

    Args:
        model: constants.
        memory: with the motor readings with which it came.
        made: moment of its stamp, in samples.
        rate: reading.
    """
    newest, rate_hz = memory.newest, model.rate_hz
    stamp = made - model.gyro_clock * rate_hz
    moment = stamp - memory.belief.estimate.clock * rate_hz
    entry = 0 if math.isnan(moment) else entry_of(memory.history, newest, math.ceil(moment))
    if -1.0 < moment <= 0.0:
        # of sample 0, which is there already
        return Placed(memory, newest)
    early = moment > memory.history.inputs[row_of(memory.history, newest), SAMPLE] + EARLIEST * rate_hz
    if entry == 0 or early or not math.isfinite(rate):
        return Placed(with_gyro(memory, not_used(memory.gyro, rate, early)), newest)
    at = float(memory.history.inputs[row_of(memory.history, entry), SAMPLE])
    keep_rate(memory.history, entry, rate, (stamp - at) / rate_hz)
    expected = turn_rate(model.filter, belief_at(memory.history, entry - 1).estimate)
    return Placed(with_gyro(memory, used(memory.gyro, rate, expected)), entry)


def with_gyro(memory: EstimatorMemory, gyro: GyroHeard) -> EstimatorMemory:
    """Return a memory in which something else has been heard of the gyroscope."""
    return changed_memory(memory, memory.belief, memory.near, memory.misfit, memory.pattern, gyro)


def with_elbow(model: EstimatorModel, memory: EstimatorMemory, made: float, reading: float) -> Placed:
    """Add a reading (rad) of the passive joint's encoder, as `with_rate` does; readings come in their order.

    One between two samples is moved to the later one by the speed that is expected.
    """
    newest, history = memory.newest, memory.history
    entry = entry_of(history, newest, math.ceil(made))
    if entry == 0:
        return Placed(memory, newest)
    speed = elbow_speed(model.filter, belief_at(history, entry - 1).estimate, model.elbow)
    repeated = repetitions(memory.elbow, memory.elbow_repeated, reading)
    if math.isnan(memory.elbow):
        angle = first_angle(model.elbow_resolution, reading)
    else:
        angle = next_angle(model.elbow_resolution, model.elbow_rate, memory.elbow, repeated, reading, speed)
    since = (float(history.inputs[row_of(history, entry), SAMPLE]) - made) / model.rate_hz
    keep_elbow(history, entry, Angle(angle.value - model.elbow_zero + since * speed, angle.variance))
    changed = EstimatorMemory(
        belief=memory.belief,
        newest=newest,
        last1=memory.last1,
        last2=memory.last2,
        before1=memory.before1,
        before2=memory.before2,
        repeated1=memory.repeated1,
        repeated2=memory.repeated2,
        elbow=reading,
        elbow_repeated=repeated,
        near=memory.near,
        misfit=memory.misfit,
        pattern=memory.pattern,
        gyro=memory.gyro,
        history=history,
    )
    return Placed(changed, entry)


def with_seen(
    model: EstimatorModel, memory: EstimatorMemory, made: float, x: float, y: float, variance: float
) -> Placed:
    """Add a position (m) by the camera with the variance (m^2) that it says of itself, as `with_rate` does.

    It is put at the sample before its exposure, and takes effect there: what followed is worked out again.
    """
    entry = entry_of(memory.history, memory.newest, math.floor(made))
    if entry == 0:
        return Placed(memory, memory.newest)
    at = float(memory.history.inputs[row_of(memory.history, entry), SAMPLE])
    lag = (made - at) / model.rate_hz
    keep_seen(memory.history, entry, x, y, lag, max(variance, model.camera_variance))
    return Placed(memory, entry)


def with_readings(
    model: EstimatorModel,
    memory: EstimatorMemory,
    sample: int,
    periods: int,
    q11: float,
    q21: float,
    tau1: float,
    tau2: float,
    rates: Readings,
    elbows: Readings,
    seen: Readings,
) -> Placed:
    """Return the memory with all readings that came with a sample, to be taken by `next_update`.

    Args:
        model: constants.
        memory: of the readings before.
        sample, periods, q11, q21, tau1, tau2: the motors', see `with_motors`.
        rates: of the gyroscope, each with moment (samples) and rate (rad/s).
        elbows: of the passive joint's encoder, each with moment and angle (rad), in their order.
        seen: positions by the camera, each with moment, x, y (m) and the standard deviation (m) of either.
    """
    memory = with_motors(memory, sample, periods, q11, q21, tau1, tau2)
    start = memory.newest
    for number in range(len(rates)):
        heard = with_rate(model, memory, rates[number][0], rates[number][1])
        memory, start = heard.memory, min(start, heard.start)
    for number in range(len(elbows)):
        placed = with_elbow(model, memory, elbows[number][0], elbows[number][1])
        memory, start = placed.memory, min(start, placed.start)
    for number in range(len(seen)):
        made, x, y, deviation = seen[number][0], seen[number][1], seen[number][2], seen[number][3]
        start = min(start, with_seen(model, memory, made, x, y, deviation * deviation).start)
    return Placed(memory, start)


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
