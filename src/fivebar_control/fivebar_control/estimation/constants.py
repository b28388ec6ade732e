"""The estimator's constants: what it knows of robot, drives and sensors."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.estimation.ekf import EkfSettings, FilterModel, filter_model
from fivebar_control.estimation.encoder import count_angle
from fivebar_control.estimation.mirror import AmbiguityLimits
from fivebar_control.estimation.watch_limits import largest_bending, share_of_one, watch_limits
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
        gyro: whether there is a gyroscope.
        gyro_silence: periods without a reading of it that can be used, beyond which it counts as missing.
        gyro_clock: by how much the stamps of the gyroscope's clock are known to be late (s).
        elbow: leg, 1 or 2, with an encoder on its passive joint, 0 for none.
        elbow_resolution: angle of its count (rad), 0 for an exact one.
        elbow_rate: its readings per second.
        elbow_zero: its reading where the angle is 0, as far as it is known (rad).
        camera_variance: least variance of a coordinate by the camera (m^2).
        camera_gate: standard deviations beyond which a position by the camera is not taken.
        misfit_share: weight of a sample in the mean of the squared innovations.
        offset_share: weight of an innovation in the mean of one sensor's with their signs.
        misfit_limit: of that mean.
        offset_limit: of the mean of one sensor's innovations with their signs, in standard deviations.
        jump_limit: of a motor encoder's innovation in a single sample, in standard deviations.
        error_limit: of a constant error as it is estimated, in units of its tolerance.
        history: samples that are kept for late readings.
    """

    filter: FilterModel
    resolution: float
    play: float
    rate_hz: int
    delay_samples: int
    torque_limit: float
    limits: AmbiguityLimits
    gyro: bool
    gyro_silence: float
    gyro_clock: float
    elbow: int
    elbow_resolution: float
    elbow_rate: int
    elbow_zero: float
    camera_variance: float
    camera_gate: float
    misfit_share: float
    offset_share: float
    misfit_limit: float
    offset_limit: float
    jump_limit: float
    error_limit: float
    history: int


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
    torque_limit = math.inf if drives.torque_limit is None else float(drives.torque_limit)
    bending = largest_bending(robot, numbers.play_frequency, torque_limit)
    limits = watch_limits(numbers, rate_hz, bending, float(tolerances.zero))
    others = settings.gyro or settings.camera or passive.leg > 0
    return EstimatorModel(
        filter=filter_model(robot, mode1, mode2, rate_hz, numbers, as_numbers(tolerances), others),
        resolution=count_angle(drives.encoder_counts or 0),
        play=numbers.play * numbers.play,
        rate_hz=rate_hz,
        delay_samples=drives.delay_samples,
        torque_limit=torque_limit,
        limits=AmbiguityLimits(
            numbers.mirror_deviations,
            # the camera sees on which side of the locus the platform is; where it has been lost, the deviations decide
            math.inf if settings.camera else numbers.dwell_limit,
        ),
        gyro=numbers.gyro,
        gyro_silence=float(numbers.gyro_timeout * rate_hz),
        gyro_clock=float(known.imu_clock),
        elbow=passive.leg,
        elbow_resolution=count_angle(passive.counts or 0),
        elbow_rate=max(1, rate_hz // passive.schedule(rate_hz).every),
        elbow_zero=float(known.passive_zero),
        camera_variance=numbers.camera_deviation * numbers.camera_deviation,
        camera_gate=numbers.camera_gate,
        misfit_share=share_of_one(rate_hz, numbers.misfit_time),
        offset_share=share_of_one(rate_hz, numbers.offset_time),
        misfit_limit=limits.misfit_limit,
        offset_limit=limits.offset_limit,
        jump_limit=limits.jump_limit,
        error_limit=numbers.error_limit or math.inf,
        history=_history(rate_hz, settings, passive),
    )


def history_samples(rate_hz: int, latency: float = LONGEST_LATENCY) -> int:
    """Return how many samples are kept, so that readings that are so late (s) still find theirs."""
    return math.ceil(latency * rate_hz) + 2


def _history(rate_hz: int, settings: EkfSettings, passive: PassiveEncoder) -> int:
    if settings.camera:
        return history_samples(rate_hz, max(LONGEST_LATENCY, settings.camera_latency))
    return history_samples(rate_hz) if settings.gyro or passive.leg else 2
