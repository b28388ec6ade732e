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
    filter_model,
    guessed,
    predicted,
)
from fivebar_control.estimation.encoder import Angle, count_angle, first_angle, next_angle, repetitions, with_variance
from fivebar_control.estimation.history import (
    ELBOW,
    ELBOW_IS_NEW,
    ELBOW_VARIANCE,
    LAG,
    PERIODS,
    RATE,
    RATE_IS_NEW,
    SAMPLE,
    SEEN_LAG,
    SEEN_VARIANCE,
    SEEN_X,
    SEEN_Y,
    TAU1,
    TAU2,
    History,
    angle_at,
    belief_at,
    empty_history,
    entry_of,
    keep_angles,
    keep_belief,
    keep_elbow,
    keep_inputs,
    keep_rate,
    keep_seen,
    row_of,
)
from fivebar_control.estimation.measurements import (
    corrected,
    elbow_speed,
    elbow_turned,
    homed_belief,
    motor_speeds,
    seen_at,
    turn_rate,
    turned,
)
from fivebar_control.estimation.mirror import AmbiguityCheck, AmbiguityLimits, check_ambiguity
from fivebar_control.model.geometry import direct_geometry
from fivebar_control.model.kinematics import joints_of, state_from_platform
from fivebar_control.model.state import Joints
from fivebar_description.known_sensors import NOTHING_KNOWN, KnownSensors
from fivebar_description.parameters import FiveBar
from fivebar_description.passive_encoder import NO_ENCODER, PassiveEncoder
from fivebar_description.readings import LONGEST_LATENCY
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
        gyro_clock: by how much the stamps of the gyroscope's clock are known to be late (s).
        elbow: leg, 1 or 2, with an encoder on its passive joint, 0 for none.
        elbow_resolution: angle of its count (rad), 0 for an exact one.
        elbow_rate: its readings per second.
        elbow_zero: its reading where the angle is 0, as far as it is known (rad).
        camera_variance: least variance of a coordinate by the camera (m^2).
        camera_gate: standard deviations beyond which a position by the camera is not taken.
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
    gyro_clock: float
    elbow: int
    elbow_resolution: float
    elbow_rate: int
    elbow_zero: float
    camera_variance: float
    camera_gate: float
    misfit_share: float
    misfit_limit: float
    history: int


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
    passive: PassiveEncoder = NO_ENCODER,
    known: KnownSensors = NOTHING_KNOWN,
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
        limits=AmbiguityLimits(
            numbers.mirror_deviations,
            # the camera sees on which side of the locus the platform is; where it has been lost, the deviations decide
            math.inf if settings.camera else numbers.dwell_limit,
        ),
        gyro_clock=float(known.imu_clock),
        elbow=passive.leg,
        elbow_resolution=count_angle(passive.counts or 0),
        elbow_rate=max(1, rate_hz // passive.schedule(rate_hz).every),
        elbow_zero=float(known.passive_zero),
        camera_variance=numbers.camera_deviation * numbers.camera_deviation,
        camera_gate=numbers.camera_gate,
        misfit_share=1.0 - math.exp(-1.0 / (rate_hz * numbers.misfit_time)),
        misfit_limit=numbers.misfit_limit,
        history=_history(rate_hz, settings, passive),
    )


def history_samples(rate_hz: int, latency: float = LONGEST_LATENCY) -> int:
    """Return how many samples are kept, so that readings that are so late (s) still find theirs."""
    return math.ceil(latency * rate_hz) + 2


def _history(rate_hz: int, settings: EkfSettings, passive: PassiveEncoder) -> int:
    if settings.camera:
        return history_samples(rate_hz, max(LONGEST_LATENCY, settings.camera_latency))
    return history_samples(rate_hz) if settings.gyro or passive.leg else 2


def first_update(model: EstimatorModel, assembly: int, q11: float, q21: float) -> EstimatorMemory:
    """Return the memory after the first readings (rad), those of sample 0, of a robot at rest in an assembly mode."""
    one, two = first_angle(model.resolution, q11), first_angle(model.resolution, q21)
    x, y = direct_geometry(model.filter.robot, assembly, one.value, two.value)
    belief = homed_belief(model.filter, x, y, one.variance + model.play)
    history = empty_history(model.history)
    keep_inputs(history, 0, 0, 0, 0.0, 0.0)
    keep_belief(history, 0, belief)
    return EstimatorMemory(belief, 0, q11, q21, q11, q21, 1, 1, math.nan, 1, 0, Misfit(1.0, 1.0, 1.0), history)


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
    left out.

    Args:
        model: constants.
        memory: with the motor readings with which it came.
        made: moment of its stamp, in samples.
        rate: reading.
    """
    newest, rate_hz = memory.newest, model.rate_hz
    stamp = made - model.gyro_clock * rate_hz
    entry = entry_of(memory.history, newest, math.ceil(stamp - memory.belief.estimate.clock * rate_hz))
    if entry == 0:
        return Placed(memory, newest)
    at = float(memory.history.inputs[row_of(memory.history, entry), SAMPLE])
    keep_rate(memory.history, entry, rate, (stamp - at) / rate_hz)
    return Placed(memory, entry)


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
                inputs[RATE_IS_NEW] = 0.0
        if not math.isnan(inputs[SEEN_X]):
            x, y, lag = float(inputs[SEEN_X]), float(inputs[SEEN_Y]), float(inputs[SEEN_LAG])
            belief = seen_at(belief, x, y, lag, float(inputs[SEEN_VARIANCE]), model.camera_gate).belief
        keep_belief(history, entry, belief)
    changed = changed_memory(memory, belief, memory.near, Misfit(encoders, gyro, elbow))
    return Update(changed, expected, Misfit(by_encoders, mean_of(by_gyro), mean_of(by_elbow)))


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
        memory.elbow,
        memory.elbow_repeated,
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
    misfit = memory.misfit
    inconsistent = not max(misfit.encoders, misfit.gyro, misfit.elbow) <= model.misfit_limit
    return Prediction(kept, estimate, joints, False, check, inconsistent)


def inconsistency_reason(model: EstimatorModel, misfit: Misfit) -> str:
    """Return in words why an estimate is inconsistent.

    All sensors beyond half the limit are named, the furthest first: one that is wrong takes the estimate away from what
    the others read, so that the furthest need not be the cause.
    """
    far = sorted(
        (
            (misfit.encoders, "the motor encoders differ"),
            (misfit.gyro, "the gyroscope differs"),
            (misfit.elbow, "the passive joint's encoder differs"),
        ),
        reverse=True,
    )
    (mean, sensor), *others = far
    also = "".join(f", {other} by {math.sqrt(one):.1f}" for one, other in others if one > 0.25 * model.misfit_limit)
    return (
        f"{sensor} from the predictions by {math.sqrt(mean):.1f} standard deviations{also}, limit"
        f" {math.sqrt(model.misfit_limit):.1f}: check the robot's geometry and zeros against `tolerances`, and each"
        " sensor, its mounting and its clock"
    )
