# SPDX-License-Identifier: Apache-2.0
"""The likeliest of several motions to the same end, found with few robots where few can tell."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Generic, NamedTuple

from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.planned_motion import M, PlannedMotion
from fivebar_bringup.odds.robot_errors import RobotErrors
from fivebar_bringup.odds.trials import OTHER_ROBOTS, ROBOTS, Trials, trials_of

FIRST_ROBOTS = 6
"""Robots on which each motion is tried first."""


class Choice(NamedTuple, Generic[M]):
    """A motion and its odds, on other robots than those by which it was chosen.

    Attributes:
        motion: that was chosen.
        odds: how many of the robots make it.
        robots: their numbers.
        failed: those that do not make it, and how each falls short.
    """

    motion: PlannedMotion[M]
    odds: Odds
    robots: range = OTHER_ROBOTS
    failed: Mapping[int, str] = {}

    @property
    def likely(self) -> bool:
        """Whether enough of the robots make it, counting those that could not be tried for want of time."""
        untried = len(self.robots) - self.odds.robots
        return self.odds.successes + untried >= self.motion.required * len(self.robots)


def likeliest(
    motions: Sequence[PlannedMotion[M]],
    errors: RobotErrors,
    seed: int,
    until: float = math.inf,
    judges: range = OTHER_ROBOTS,
) -> Choice[M] | None:
    """Return the motion with the best odds; None without motions or time left.

    All motions are tried on the same few robots, the more promising half of them on twice as many, and so on. The one
    that is left is tried on robots that had no part in the choice: the best of many looks better than it is on those
    that did.

    Args:
        motions: to choose from.
        errors, seed: of the drawn robots.
        until: when no further robot is tried (s on the steady clock).
        judges: numbers of the robots on which the chosen motion is tried; those below `ROBOTS` choose.
    """
    left = [(motion, Trials()) for motion in motions]
    robots = FIRST_ROBOTS
    while len(left) > 1:
        tried = [
            (motion, trials + trials_of(motion.scenario, errors, seed, range(trials.odds.robots, robots), until))
            for motion, trials in left
        ]
        if any(trials.odds.robots < robots for _, trials in tried):
            return None
        # in case of equality the first of them, as they were given
        tried.sort(key=lambda motion_and_trials: -motion_and_trials[1].promise)
        left = tried[: (len(tried) + 1) // 2]
        robots = min(2 * robots, ROBOTS)
    if not left:
        return None
    motion = left[0][0]
    odds, _, failed = trials_of(motion.scenario, errors, seed, judges, until)
    return Choice(motion, odds, judges, failed) if odds.robots == len(judges) else None
