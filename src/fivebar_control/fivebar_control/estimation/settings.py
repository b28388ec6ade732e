# SPDX-License-Identifier: Apache-2.0
"""The estimator's settings, and what it knows of encoders and drives."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.extra_sensor import MountedSensor
from fivebar_description.sensors import NO_ENCODER, NOTHING_KNOWN, KnownSensors, PassiveEncoder
from fivebar_description.settings import Setting
from fivebar_description.shared_settings import DelaySamples, DriveTorqueLimit, EncoderCounts
from fivebar_description.tolerances import EXACT, Tolerances


class EkfSettings(NamedTuple):
    """Noise assumptions of the filter, limits of its validity, and the use of its estimates.

    On the locus the uncertainty along t_s grows with the acceleration noise, since no motor torque acts on the platform
    in that direction (1.19). A robot's file may scale the disturbances to the torque of its crossings (`drives`), or
    give noises of its own (`tuning`).
    """

    acceleration_noise: Annotated[
        float,
        Setting(
            "Density of the platform acceleration that the model does not explain.",
            "m/s^2 per root Hz",
            at_least=1e-6,
            at_most=1e3,
        ),
    ] = 0.02
    disturbance_rate: Annotated[
        float,
        Setting("Density of the disturbance torques' random walk.", "Nm per root s", at_least=0.0, at_most=1e3),
    ] = 1.0
    disturbance_initial: Annotated[
        float,
        Setting("Standard deviation of the disturbance torques at the start.", "Nm", at_least=0.0, at_most=1e3),
    ] = 0.1
    force_deviation: Annotated[
        float,
        Setting(
            "Standard deviation of each component of an unknown force on the platform, 0 for none. By default what the"
            " loads of the robot's file come to.",
            "N",
            at_least=0.0,
            at_most=1e4,
        ),
    ] = 0.0
    force_time: Annotated[
        float,
        Setting("Correlation time of that force.", "s", at_least=1e-3, at_most=1e3),
    ] = 0.1
    play: Annotated[
        float,
        Setting(
            "Standard deviation of the angle between a motor and its link: backlash and elasticity.",
            "rad",
            at_least=0.0,
            at_most=1.0,
        ),
    ] = 0.0
    play_frequency: Annotated[
        float,
        Setting(
            "Frequency at which motor and link swing against each other, from which `misfit_limit` and `jump_limit`"
            " follow; 0 for rigid transmissions. By default that of the robot's file.",
            "Hz",
            at_least=0.0,
            at_most=2000.0,
        ),
    ] = 0.0
    homing_tolerance: Annotated[
        float,
        Setting("Largest angle between an encoder and the declared homing posture.", "rad", at_least=1e-6, at_most=1.0),
    ] = 0.02
    mirror_deviations: Annotated[
        float,
        Setting(
            "Distance of the other assembly mode, in standard deviations, below which the estimate is ambiguous.",
            at_least=0.0,
            at_most=1e3,
        ),
    ] = 5.0
    dwell_limit: Annotated[
        float,
        Setting(
            "Time near the Type 2 locus after which the estimate is ambiguous, whatever the deviations.",
            "s",
            at_least=1e-3,
            at_most=1e6,
        ),
    ] = 0.2
    misfit_limit: Annotated[
        float,
        Setting(
            "Mean of the squared innovations, in units of their variance, beyond which the estimate is inconsistent; 0"
            " for the one that follows from what is declared.",
            at_least=0.0,
            at_most=1e9,
        ),
    ] = 0.0
    offset_limit: Annotated[
        float,
        Setting(
            "Mean of one sensor's innovations with their signs, beyond which the estimate is"
            " inconsistent; 0 for the one that follows from what is declared.",
            "standard deviations",
            at_least=0.0,
            at_most=1e9,
        ),
    ] = 0.0
    jump_limit: Annotated[
        float,
        Setting(
            "Innovation of a motor encoder in a single sample, beyond which the estimate is"
            " inconsistent; 0 for the one that follows from what is declared.",
            "standard deviations",
            at_least=0.0,
            at_most=1e9,
        ),
    ] = 0.0
    error_limit: Annotated[
        float,
        Setting(
            "Constant error of the robot or a sensor as it is estimated, beyond which the estimate is inconsistent; it"
            " counts together with the mean of `offset_limit`. 0 for none.",
            "tolerances",
            at_least=0.0,
            at_most=1e9,
        ),
    ] = 0.0
    gyro: Annotated[
        bool,
        Setting("Whether the estimator uses the gyroscope of `imu/data` on the distal link of leg 2."),
    ] = False
    gyro_noise: Annotated[
        float,
        Setting(
            "Standard deviation of a gyroscope reading's white noise; 0.003 to 0.02 for MEMS parts.",
            "rad/s",
            at_least=1e-6,
            at_most=10.0,
        ),
    ] = 0.01
    gyro_bias: Annotated[
        float,
        Setting("Standard deviation of the gyroscope's bias at the start.", "rad/s", at_least=0.0, at_most=10.0),
    ] = 0.02
    gyro_bias_rate: Annotated[
        float,
        Setting("Density of the random walk of the gyroscope's bias.", "rad/s per root s", at_least=0.0, at_most=10.0),
    ] = 0.02
    gyro_clock: Annotated[
        float,
        Setting(
            "Standard deviation of the offset of the gyroscope's clock at the start, which is then estimated; 0 where"
            " its stamps are those of the robot's clock.",
            "s",
            at_least=0.0,
            at_most=0.02,
        ),
    ] = 0.0005
    gyro_clock_rate: Annotated[
        float,
        Setting(
            "Density of the random walk of that offset, where it is estimated.",
            "s per root s",
            at_least=0.0,
            at_most=0.01,
        ),
    ] = 1e-4
    gyro_timeout: Annotated[
        float,
        Setting(
            "Time without a reading of the gyroscope that can be used after which it counts as missing, never where"
            " null.",
            "s",
            at_least=0.01,
            unlimited=True,
        ),
    ] = 0.1
    camera: Annotated[
        bool,
        Setting("Whether the estimator uses the platform's position by the camera of `vision/platform`."),
    ] = False
    camera_deviation: Annotated[
        float,
        Setting(
            "Least standard deviation of such a position: what lens, tag height and stamp leave, whatever it says.",
            "m",
            at_least=1e-7,
            at_most=0.1,
        ),
    ] = 5e-5
    seen_start: Annotated[
        bool,
        Setting("Take the assembly mode at the start from the camera instead of the declared posture."),
    ] = False
    feed_forward: Annotated[
        bool,
        Setting("Whether laws without an observer of their own compensate the estimated disturbance torques."),
    ] = True


class Drives(NamedTuple):
    """The estimator's model of the motors' encoders and drives."""

    encoder_counts: EncoderCounts = None
    delay_samples: DelaySamples = 0
    torque_limit: DriveTorqueLimit = None


class Sensing(NamedTuple):
    """The means of an estimator, as declared.

    Attributes:
        rate_hz: samples per second.
        drives: encoders and drives.
        settings: of the filter; `gyro` and `camera` say whether there are these.
        tolerances: how exactly the robot is known.
        passive: the encoder on a passive joint.
        known: errors of the sensors that have been measured.
        extra: a sensor from another package, None for none.
        gyro_every: samples from one gyroscope reading to the next.
        camera_every: samples from one position by the camera to the next, 0 for none.
    """

    rate_hz: int
    drives: Drives
    settings: EkfSettings
    tolerances: Tolerances = EXACT
    passive: PassiveEncoder = NO_ENCODER
    known: KnownSensors = NOTHING_KNOWN
    extra: MountedSensor | None = None
    gyro_every: int = 1
    camera_every: int = 0

    @property
    def declared(self) -> bool:
        """Whether tolerances of the robot are declared; without, the filter is to believe the model, and so are we."""
        return self.tolerances.declared
