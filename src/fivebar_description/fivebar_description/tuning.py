# SPDX-License-Identifier: Apache-2.0
"""Settings that suit a robot: the section `tuning` of a robot file, the defaults of its scenarios."""

from __future__ import annotations

from typing import Annotated, NamedTuple

from fivebar_description.settings import Setting


class Tuning(NamedTuple):
    """Bandwidth and noises that suit the robot. What is left out has the default of the settings that it stands for."""

    bandwidth: Annotated[
        float | None,
        Setting(
            "Bandwidth w of the unified law: kp = w^2, kd = 2 w; at most a tenth of the lowest frequency of the"
            " transmissions (`fivebar identify --resonance`).",
            "rad/s",
            above=0.0,
            at_most=1e3,
        ),
    ] = None
    acceleration_noise: Annotated[
        float | None, Setting("Of the estimator's noises.", "m/s^2 per root Hz", above=0.0, at_most=1e3)
    ] = None
    disturbance_rate: Annotated[
        float | None, Setting("Of the estimator's noises.", "Nm per root s", above=0.0, at_most=1e3)
    ] = None
    gyro_noise: Annotated[
        float | None,
        Setting(
            "Noise of a gyroscope's reading as the estimator takes it; more than the sensor's own where links swing.",
            "rad/s",
            above=0.0,
            at_most=10.0,
        ),
    ] = None
    play: Annotated[
        float | None,
        Setting(
            "Standard deviation of the angle between a motor and its link that the estimator expects.",
            "rad",
            at_least=0.0,
            at_most=1.0,
        ),
    ] = None
    force_deviation: Annotated[
        float | None,
        Setting(
            "Standard deviation of an unknown force on the platform that the estimator expects; by default what `loads`"
            " come to.",
            "N",
            at_least=0.0,
            at_most=1e4,
        ),
    ] = None
    misfit_limit: Annotated[
        float | None,
        Setting(
            "Mean of the squared innovations, in units of their variance, beyond which the estimate is inconsistent.",
            at_least=1.0,
            at_most=1e9,
        ),
    ] = None


NO_TUNING = Tuning()
"""Nothing is known."""
