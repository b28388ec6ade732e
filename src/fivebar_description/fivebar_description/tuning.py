"""What suits a robot: the section `tuning` of a robot file, the defaults of its scenarios."""

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


NO_TUNING = Tuning()
"""Nothing is known."""
