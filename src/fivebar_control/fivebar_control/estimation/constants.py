# SPDX-License-Identifier: Apache-2.0
"""The estimator's constants: what it knows of robot, drives and sensors."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

from fivebar_control.estimation.ekf import FilterModel, filter_model
from fivebar_control.estimation.encoder import count_angle
from fivebar_control.estimation.mirror import AmbiguityLimits
from fivebar_control.estimation.settings import EkfSettings, Sensing
from fivebar_control.model.state import WorkingMode
from fivebar_description.parameters import FiveBar
from fivebar_description.sensors import LONGEST_LATENCY
from fivebar_description.settings import as_numbers

OFFSET, JUMP, MISFIT = 9.0, 10.0, 50.0
"""Least limits, the first two in standard deviations."""

BIAS = 6.0
"""The limit of the gyroscope's bias, in standard deviations of what has been learned of it: sound robots reach 4."""

JUMP_WITH_PLAY = 6.0
"""The same with `play`: what is declared of it leaves more room than counts do."""

OFFSET_WITH_ZEROS = 6.0
"""`OFFSET` with `play`, and zeros that may be wrong by more than it."""

REVERSED = 4.0
"""Travel of a rotor over the static bending under the torque that reverses: from one side to the other, and as far
again, since it overshoots."""

FASTER = 1.5
"""The assembled robot swings at up to so many times the frequency of its transmissions with locked rotors."""


MISFIT_TIME, OFFSET_TIME = 0.02, 0.05
"""Time constants (s) of the means of squared innovations and of signed ones. The derived limits hold for these: shorter
means are noisier, longer ones find a fault later. Of the gyroscope as many readings count as of motors."""

CAMERA_LATENCY = 0.1
"""Age (s) beyond which a position by the camera is discarded: so long the estimator keeps its samples."""


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
        extra: settings of a sensor from another package as numbers, None without one.
        extra_variance: of its readings, in the square of its unit.
        misfit_share: weight of a sample in the mean of the squared innovations.
        offset_share: weight of an innovation in the mean of one sensor's with their signs.
        misfit_limit: of that mean.
        offset_limit: of the mean of one sensor's innovations with their signs, in standard deviations.
        jump_limit: of a motor encoder's innovation in a single sample, in standard deviations.
        error_limit: of a constant error as it is estimated, in units of its tolerance.
        bias_limit: of the gyroscope's bias as it is estimated, in standard deviations of what has been learned of it.
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
    extra: Any
    extra_variance: float
    misfit_share: float
    offset_share: float
    misfit_limit: float
    offset_limit: float
    jump_limit: float
    error_limit: float
    bias_limit: float
    history: int


def estimator_model(robot: FiveBar, mode: WorkingMode, sensing: Sensing) -> EstimatorModel:
    """Return the constants for a robot in a working mode, each a number of one type."""
    rate_hz, drives, settings, tolerances, passive, known, extra, *_ = sensing
    numbers = as_numbers(settings)
    torque_limit = math.inf if drives.torque_limit is None else float(drives.torque_limit)
    bending = largest_bending(robot, numbers.play_frequency, torque_limit)
    limits = watch_limits(numbers, rate_hz, bending, float(tolerances.zero))
    has_late_sensors = settings.gyro or settings.camera or passive.leg > 0 or extra is not None
    spread = 0.0 if extra is None else float(extra.kind.deviation(extra.settings))
    latency = CAMERA_LATENCY if settings.camera else LONGEST_LATENCY
    return EstimatorModel(
        filter=filter_model(robot, mode, rate_hz, numbers, as_numbers(tolerances), has_late_sensors),
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
        extra=None if extra is None else extra.numbers,
        extra_variance=spread * spread,
        misfit_share=share_of_one(rate_hz, MISFIT_TIME),
        offset_share=share_of_one(rate_hz, OFFSET_TIME),
        misfit_limit=limits.misfit_limit,
        offset_limit=limits.offset_limit,
        jump_limit=limits.jump_limit,
        error_limit=numbers.error_limit or math.inf,
        bias_limit=BIAS if settings.gyro and bending <= numbers.play else math.inf,
        history=history_samples(rate_hz, latency) if has_late_sensors else 2,
    )


def history_samples(rate_hz: int, latency: float = LONGEST_LATENCY) -> int:
    """Return how many samples are kept, so that readings that are so late (s) still find theirs."""
    return math.ceil(latency * rate_hz) + 2


class WatchLimits(NamedTuple):
    """Limits of the watch, by their names among the settings of the estimator."""

    misfit_limit: float
    offset_limit: float
    jump_limit: float


NO_LIMITS = WatchLimits(1e9, math.inf, math.inf)


def share_of_one(rate_hz: int, time: float) -> float:
    """Return the weight of an innovation in a mean over a time (s)."""
    return 1.0 - math.exp(-1.0 / (rate_hz * time))


def largest_bending(robot: FiveBar, frequency: float, torque: float) -> float:
    """Return by how much a torque (Nm) bends the transmissions of a robot (rad), 0 for rigid ones.

    Their frequency (Hz) is that of a leg's inertia on the stiffness; the leg with the smaller inertia bends more.
    """
    if frequency == 0.0:
        return 0.0
    speed = 2.0 * math.pi * frequency
    return torque / (min(robot.leg1.inertia, robot.leg2.inertia) * speed * speed)


def watch_limits(settings: EkfSettings, rate_hz: int, bending: float = 0.0, zero: float = 0.0) -> WatchLimits:
    """Return the limits of an estimator: those that are set, and derived ones for those that are 0.

    Args:
        settings: of the estimator.
        rate_hz: samples per second.
        bending: largest one of the transmissions under a torque (rad), see `largest_bending`.
        zero: tolerance of the encoders' zeros (rad).
    """
    declared = (settings.misfit_limit, settings.offset_limit, settings.jump_limit)
    derived = (MISFIT, math.inf, math.inf)
    if settings.gyro:
        share = share_of_one(rate_hz, OFFSET_TIME)
        swing = 2.0 * math.pi * FASTER * settings.play_frequency * settings.play / settings.gyro_noise
        offset, jump = OFFSET, JUMP
        if bending > settings.play:
            offset, jump = math.inf, math.inf
        elif settings.play > 0.0:
            jump = math.hypot(JUMP_WITH_PLAY, REVERSED * bending / settings.play)
            offset = OFFSET_WITH_ZEROS if zero > settings.play else OFFSET
        if settings.force_deviation == 0.0:
            offset = math.inf
        derived = (max(MISFIT, swing * swing), offset * math.sqrt(share / (2.0 - share)), jump)
    return WatchLimits(*(limit if limit != 0.0 else default for limit, default in zip(declared, derived, strict=True)))
