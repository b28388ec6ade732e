# SPDX-License-Identifier: Apache-2.0
"""Detection of a frozen encoder: its reading is constant although the motor must be turning.

A constant reading is no fault by itself: at rest, on a slow motion, and where a motor reverses, the angle is within the
same count for many samples, and the filter predicts it there, too. An encoder is named as frozen where two things come
together:

* the predictions differ from the reading by more than tolerances and play explain, sample after sample, and
* the motor cannot have stopped: its readings had been changing so fast that it cannot stop within a count, however it
  is braked; or the predictions have gone far away from the reading while the other motor turned.

Otherwise what contradicts the model may be anything else, and is not given this name. Where an encoder freezes just as
its motor turns back, its readings were not changing fast, and the predictions take a tenth of a second or more to go
away: `tracking_lost` may come first.

A single repetition is none of these: a motor that a law turns back at once may read the same again. Where innovations
have made the estimate inconsistent while a sensor has begun to repeat itself, the fault waits for the next readings,
for at most `HELD`: then the reading has changed, or its sensor is named (`named_fault`).

Without torque both motors come to rest, light links on friction within a sample or two, and samples of drives that are
stopped need not be evenly spaced, so that the predictions are off: then a reading must also stay while the other motor
turns.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.estimation.constants import EstimatorModel
from fivebar_control.estimation.covariance import ERRORS
from fivebar_control.estimation.ekf import Estimate
from fivebar_control.estimation.fault_numbers import ENCODER_FROZEN, ESTIMATE_INCONSISTENT
from fivebar_control.estimation.gyro_watch import GyroHeard, gyro_cause, repeats
from fivebar_control.estimation.measurements import encoder_row, share_of_errors
from fivebar_control.estimation.platform_motion import leg_at_rest
from fivebar_control.model.geometry import wrap
from fivebar_control.safety.stages import NO_FAULT

FEWEST = 3
"""Readings in a row that are the same before an encoder is called frozen."""

HELD, LEAST_HELD = 0.012, 2
"""Time (s) for which an inconsistent estimate waits for a name while a sensor repeats its reading, and the least number
of samples."""

FORGOTTEN = 0.05
"""Share of the summed differences that each further reading forgets: half a count at rest must not add up for ever."""

COUNTS = 5.0
ANGLE = 1e-3
"""An encoder is frozen when the differences from the predictions sum to this many counts and this angle (rad)."""

DEVIATIONS = 3.0
"""Standard deviations of constant errors and play by which a prediction may differ: a healthy encoder on a robot that
is known so well only."""

BRAKING, WITHIN = 180.0, 3e-4
"""The hardest that a law brakes a motor which then stays where it is (rad/s^2), and the least angle (rad) in which one
can be seen to have stopped."""

SURE = 5
"""Readings in a row that are the same up to which a motor may have been braked by all of its drive's torque."""

AWAY = 10.0
"""Counts by which the predictions have gone away, and the other motor has turned, where the pace tells nothing."""

MOST = 10_000
"""Readings beyond which nobody counts."""


class EncoderStay(NamedTuple):
    """One motor's encoder, and for how long it has read the same.

    Attributes:
        reading: its last reading (rad).
        stays: readings in a row that are the same.
        beyond: sum of their differences from the predictions beyond what is explained (rad).
        pace: least magnitude of the last changes of the reading per sample before (rad).
        change: last of these changes (rad).
        first: prediction for the first of the equal readings (rad).
        travel: by how much the predictions have changed since, at most (rad).
        other: reading of the other motor then (rad).
        turned: by how much the other motor has turned since (rad).
        margin: what is explained of a difference (rad).
    """

    reading: float
    stays: int
    beyond: float
    pace: float
    change: float
    first: float
    travel: float
    other: float
    turned: float
    margin: float


class FrozenMemory(NamedTuple):
    """Both encoders, whose readings are NaN before the first.

    Attributes:
        motor1, motor2: the encoder of each motor.
        held: samples for which an inconsistent estimate has waited for a name.
    """

    motor1: EncoderStay
    motor2: EncoderStay
    held: int = 0


def nothing_read() -> FrozenMemory:
    """Return the memory before the first readings."""
    none = EncoderStay(math.nan, 1, 0.0, 0.0, 0.0, math.nan, 0.0, math.nan, 0.0, 0.0)
    return FrozenMemory(none, none, 0)


def after_readings(
    model: EstimatorModel, memory: FrozenMemory, q11: float, q21: float, expected: Estimate, gap: bool, coasts: bool
) -> FrozenMemory:
    """Return the memory after readings; call it once per sample.

    Args:
        model: of the estimator.
        memory: of the readings before.
        q11, q21: readings of both motors (rad).
        expected: the prediction for them.
        gap: whether readings before these were lost, over which the prediction is a guess.
        coasts: whether no torque is commanded any more.
    """
    same = q11 == memory.motor1.reading and q21 == memory.motor2.reading
    restarts = math.isnan(memory.motor1.reading) or gap or (coasts and same)
    stay1 = _stay_after(model, memory.motor1, 1, q11, q21, expected, restarts)
    return FrozenMemory(stay1, _stay_after(model, memory.motor2, 2, q21, q11, expected, restarts), memory.held)


def _stay_after(
    model: EstimatorModel,
    stay: EncoderStay,
    motor: int,
    reading: float,
    other: float,
    expected: Estimate,
    restarts: bool,
) -> EncoderStay:
    constants = model.filter
    leg = constants.robot.leg1 if motor == 1 else constants.robot.leg2
    mode = constants.mode[0] if motor == 1 else constants.mode[1]
    moving = leg_at_rest(leg, mode, expected.x, expected.y)
    row = encoder_row(motor, moving)
    predicted = math.atan2(moving.r_y, moving.r_x) + share_of_errors(expected, row)
    explained = model.play
    for index, deviation in enumerate(constants.errors):
        effect = deviation * float(row[ERRORS + index])
        explained += effect * effect
    margin = DEVIATIONS * math.sqrt(explained)
    if restarts:
        return EncoderStay(reading, 1, 0.0, 0.0, 0.0, predicted, 0.0, other, 0.0, margin)
    if reading != stay.reading:
        change = wrap(reading - stay.reading) / stay.stays
        # a motor that has turned back has no pace
        pace = min(abs(change), abs(stay.change)) if change * stay.change > 0.0 else 0.0
        return EncoderStay(reading, 1, 0.0, pace, change, predicted, 0.0, other, 0.0, margin)
    return EncoderStay(
        reading,
        min(stay.stays + 1, MOST),
        (1.0 - FORGOTTEN) * stay.beyond + max(0.0, abs(wrap(reading - predicted)) - margin),
        stay.pace,
        stay.change,
        stay.first,
        max(stay.travel, abs(wrap(predicted - stay.first))),
        stay.other,
        max(stay.turned, abs(wrap(other - stay.other))),
        margin,
    )


def named_motor(model: EstimatorModel, memory: FrozenMemory, inconsistent: bool) -> int:
    """Return which motor's encoder is named as frozen, 0 for none: less has to be seen where the estimate is wrong."""
    limit = COUNTS * model.resolution + (0.0 if inconsistent else ANGLE)
    if _is_frozen(memory.motor1, model, FEWEST, limit, hardest_braking(model, 1, memory.motor1.stays)):
        return 1
    return 2 if _is_frozen(memory.motor2, model, FEWEST, limit, hardest_braking(model, 2, memory.motor2.stays)) else 0


def hardest_braking(model: EstimatorModel, motor: int, stays: int) -> float:
    """Return how hard motor 1 or 2 has been braked at most (rad/s^2), given for how many readings it has stayed.

    All of its drive's torque turns it back at once, so that its reading changes again.
    """
    if stays >= SURE or math.isinf(model.torque_limit):
        return BRAKING
    leg = model.filter.robot.leg1 if motor == 1 else model.filter.robot.leg2
    return max(BRAKING, (model.torque_limit + leg.coulomb) / leg.inertia)


def _is_frozen(stay: EncoderStay, model: EstimatorModel, fewest: int, limit: float, braking: float) -> bool:
    if not (fewest <= stay.stays and stay.beyond > limit):
        return False
    count = model.resolution
    fastest_stopped = math.sqrt(2.0 * braking * max(count, WITHIN))
    if (stay.stays - 1) * stay.pace >= count and stay.pace * model.rate_hz >= fastest_stopped:
        return True
    return stay.travel > AWAY * count + stay.margin and stay.turned > AWAY * count


def _suspected(stay: EncoderStay, model: EstimatorModel) -> bool:
    """Return whether one reading that is repeated may be the first of a frozen encoder."""
    return _is_frozen(stay, model, 2, COUNTS * model.resolution, BRAKING)


def longest_held(rate_hz: int) -> int:
    """Return for how many samples an inconsistent estimate waits for a name."""
    return max(LEAST_HELD, round(HELD * rate_hz))


class Named(NamedTuple):
    """The number of a fault, and the memory after it has been given its name."""

    trip: int
    memory: FrozenMemory


def named_fault(model: EstimatorModel, trip: int, memory: FrozenMemory, gyro: GyroHeard) -> Named:
    """Return a fault of the estimate by the name that leads to its cause, if that is seen.

    A frozen encoder is a cause, and comes before what follows from it. So is what keeps the gyroscope from being used:
    where the estimate is inconsistent, less has to be seen of it. While a sensor repeats its reading, an inconsistent
    estimate waits, and is a fault afterwards whatever its innovations are by then.
    """
    if trip == NO_FAULT and memory.held > 0:
        trip = ESTIMATE_INCONSISTENT
    inconsistent = trip == ESTIMATE_INCONSISTENT
    if named_motor(model, memory, inconsistent) > 0:
        return Named(ENCODER_FROZEN, memory)
    if not inconsistent:
        return Named(trip, memory)
    cause = gyro_cause(gyro, model.gyro_silence) if model.gyro else NO_FAULT
    if cause != NO_FAULT:
        return Named(cause, memory)
    suspected = _suspected(memory.motor1, model) or _suspected(memory.motor2, model) or (model.gyro and repeats(gyro))
    if suspected and memory.held < longest_held(model.rate_hz):
        return Named(NO_FAULT, FrozenMemory(memory.motor1, memory.motor2, memory.held + 1))
    return Named(trip, memory)


def frozen_reason(stay: EncoderStay, motor: int) -> str:
    """Return in words why the encoder of motor 1 or 2 is taken for frozen."""
    return (
        f"q{motor}1 has read the same {stay.stays} times, while the motion has gone on by {stay.travel:.4f} rad: check"
        " the encoder and its cable, or whether the motor is blocked"
    )
