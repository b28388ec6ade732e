"""The likeliest of several motions to the same end, found with few robots where few can tell."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Generic, NamedTuple, TypeVar

from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.robot_errors import RobotErrors
from fivebar_bringup.odds.trials import OTHER_ROBOTS, ROBOTS, Trials, odds_of, trials_of
from fivebar_bringup.scenario import Scenario

FIRST_ROBOTS = 6
"""Robots on which each motion is tried first."""

S = TypeVar("S", bound=Scenario)


class Choice(NamedTuple, Generic[S]):
    """A motion and its odds, on other robots than those by which it was chosen."""

    scenario: S
    odds: Odds


def likeliest(motions: Sequence[S], errors: RobotErrors, seed: int) -> Choice[S] | None:
    """Return the motion with the best odds; None of no motions.

    All motions are tried on the same few robots, the more promising half of them on twice as many, and so on. The one
    that is left is tried on robots that had no part in the choice: the best of many looks better than it is on those
    that did.
    """
    left = [(scenario, Trials()) for scenario in motions]
    robots = FIRST_ROBOTS
    while len(left) > 1:
        tried = [
            (scenario, trials + trials_of(scenario, errors, seed, range(trials.odds.robots, robots)))
            for scenario, trials in left
        ]
        # in case of equality the first of them, as they were given
        tried.sort(key=lambda one: -one[1].promise)
        left = tried[: (len(tried) + 1) // 2]
        robots = min(2 * robots, ROBOTS)
    if not left:
        return None
    scenario = left[0][0]
    return Choice(scenario, odds_of(scenario, errors, seed, OTHER_ROBOTS))
