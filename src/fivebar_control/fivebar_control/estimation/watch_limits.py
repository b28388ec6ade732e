"""Limits of the estimator's watch that follow from what is declared of a robot.

Innovations are measured in the standard deviations that follow from what is declared, so that what a sound robot makes
of them depends little on the robot and its motion. A limit that is 0 in the settings is derived here:

* the mean with the sign, `offset_limit`: of white innovations it has the standard deviation sqrt(s / (2 - s)), where s
  is the weight of one of them. `OFFSET` of these leave room for constant errors and static bending. Vibrations average
  out.
* one encoder's innovation, `jump_limit`: `JUMP` standard deviations. Both are less where `play` is declared.
* the mean square, `misfit_limit`: links that swing against their motors by `play` have a rate of 2 pi f play, which the
  model does not know. Its square over the gyroscope's variance is the limit, `MISFIT` at least; f is `play_frequency`,
  `FASTER` by what assembled robots are.

Without a gyroscope nothing contradicts the motors' encoders but the model, whose errors are not declared: then there is
`MISFIT`, and no other limit. docs/estimation.md has what sound robots reach of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.estimation.ekf import EkfSettings

OFFSET, JUMP, MISFIT = 9.0, 10.0, 50.0
"""Least limits, the first two in standard deviations."""

OFFSET_WITH_PLAY, JUMP_WITH_PLAY = 6.0, 6.0
"""The same with `play`: what is declared of it leaves more room than counts do."""

FASTER = 1.5
"""The assembled robot swings at up to so many times the frequency of its transmissions with locked rotors."""


class WatchLimits(NamedTuple):
    """Limits of the watch, by their names among the settings of the estimator."""

    misfit_limit: float
    offset_limit: float
    jump_limit: float


NO_LIMITS = WatchLimits(1e9, math.inf, math.inf)


def share_of_one(rate_hz: int, time: float) -> float:
    """Return the weight of an innovation in a mean over a time (s)."""
    return 1.0 - math.exp(-1.0 / (rate_hz * time))


def watch_limits(settings: EkfSettings, rate_hz: int) -> WatchLimits:
    """Return the limits of an estimator: those that are set, and derived ones for those that are 0."""
    given = (settings.misfit_limit, settings.offset_limit, settings.jump_limit)
    derived = (MISFIT, math.inf, math.inf)
    if settings.gyro:
        share = share_of_one(rate_hz, settings.offset_time)
        swing = 2.0 * math.pi * FASTER * settings.play_frequency * settings.play / settings.gyro_noise
        offset, jump = (OFFSET_WITH_PLAY, JUMP_WITH_PLAY) if settings.play > 0.0 else (OFFSET, JUMP)
        derived = (max(MISFIT, swing * swing), offset * math.sqrt(share / (2.0 - share)), jump)
    return WatchLimits(*(one if one != 0.0 else other for one, other in zip(given, derived, strict=True)))
