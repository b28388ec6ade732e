"""Limits of the estimator's watch that follow from what is declared of a robot.

Innovations are measured in the standard deviations that follow from what is declared, so that what a sound robot makes
of them depends little on the robot and its motion. A limit that is 0 in the settings is derived here:

* the mean with the sign, `offset_limit`: of white innovations it has the standard deviation sqrt(s / (2 - s)), where s
  is the weight of one of them. `OFFSET` of these leave room for constant errors and static bending. Vibrations average
  out. Where encoder zeros may be wrong by more than a declared `play`, the filter explains faults of sensors in part
  by the zeros, and there are `OFFSET_WITH_ZEROS`. There is no limit where `force_deviation` is 0: the model then has no
  force on the platform, and a tilt, a push or friction of the passive joints sends the innovations to one side.
* one encoder's innovation, `jump_limit`: `JUMP` standard deviations, and less where `play` is declared. Then a torque
  that reverses from one limit of the drives to the other lets a rotor swing by `REVERSED` times what the limit bends
  its transmission; the root of the sum of both squares is the limit.
* the mean square, `misfit_limit`: links that swing against their motors by `play` have a rate of 2 pi f play, which the
  model does not know. Its square over the gyroscope's variance is the limit, `MISFIT` at least; f is `play_frequency`,
  `FASTER` by what assembled robots are.

Neither offset nor jump has a limit where the drives bend the transmissions by more than `play`: it is then less than
the angle between motor and link, and does not say how far a sound robot goes.

Without a gyroscope nothing contradicts the motors' encoders but the model, whose errors are not declared: then there is
`MISFIT`, and no other limit. docs/estimation.md has what sound robots reach of them.
"""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_control.estimation.ekf import EkfSettings
from fivebar_description.parameters import FiveBar

OFFSET, JUMP, MISFIT = 9.0, 10.0, 50.0
"""Least limits, the first two in standard deviations."""

JUMP_WITH_PLAY = 6.0
"""The same with `play`: what is declared of it leaves more room than counts do."""

OFFSET_WITH_ZEROS = 6.0
"""Of the first with `play`, and zeros that may be wrong by more than it."""

REVERSED = 4.0
"""Travel of a rotor over the static bending under the torque that reverses: from one side to the other, and as far
again, since it overshoots."""

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
    given = (settings.misfit_limit, settings.offset_limit, settings.jump_limit)
    derived = (MISFIT, math.inf, math.inf)
    if settings.gyro:
        share = share_of_one(rate_hz, settings.offset_time)
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
    return WatchLimits(*(one if one != 0.0 else other for one, other in zip(given, derived, strict=True)))
