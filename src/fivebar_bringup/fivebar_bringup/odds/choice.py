"""The likeliest of several motions to the same end, found with few robots where few can tell."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Generic, NamedTuple, TypeVar

from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.robot_errors import RobotErrors
from fivebar_bringup.odds.trials import OTHER_ROBOTS, ROBOTS, Trials, odds_of, trials_of
from fivebar_bringup.scenario import Scenario

FIRST_ROBOTS = 6
"""Robots on which each motion is tried first."""

M = TypeVar("M")


class Choice(NamedTuple, Generic[M]):
    """A motion and its odds, on other robots than those by which it was chosen."""

    motion: M
    odds: Odds


def likeliest(
    motions: Sequence[M],
    scenario_of: Callable[[M], Scenario],
    errors: RobotErrors,
    seed: int,
    until: float = math.inf,
) -> Choice[M] | None:
    """Return the motion with the best odds, each by the scenario that runs it; None of no motions, or for want of time.

    All motions are tried on the same few robots, the more promising half of them on twice as many, and so on. The one
    that is left is tried on robots that had no part in the choice: the best of many looks better than it is on those
    that did.
    """
    left = [(motion, Trials()) for motion in motions]
    robots = FIRST_ROBOTS
    while len(left) > 1:
        tried = [
            (motion, trials + trials_of(scenario_of(motion), errors, seed, range(trials.odds.robots, robots), until))
            for motion, trials in left
        ]
        if any(trials.odds.robots < robots for _, trials in tried):
            return None
        # in case of equality the first of them, as they were given
        tried.sort(key=lambda one: -one[1].promise)
        left = tried[: (len(tried) + 1) // 2]
        robots = min(2 * robots, ROBOTS)
    if not left:
        return None
    motion = left[0][0]
    odds = odds_of(scenario_of(motion), errors, seed, OTHER_ROBOTS, until)
    return Choice(motion, odds) if odds.robots == len(OTHER_ROBOTS) else None
