"""The odds of a scenario's motion on robots within what its robot's file declares."""

from __future__ import annotations

from fivebar_bringup.odds.drawn_robots import declared_errors
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.robot_errors import UNIFORM
from fivebar_bringup.odds.trials import ROBOTS, trials_of
from fivebar_bringup.scenario import Scenario

SEED = 20_011
"""Of the drawn robots: all motions are tried on the same ones."""


def declared_odds(scenario: Scenario, robots: int = ROBOTS, distribution: str = UNIFORM) -> Odds:
    """Return the odds of a scenario's motion on so many robots, whose errors are distributed in some way.

    Raises:
        PlanRefused: the motion cannot be made.
    """
    errors = declared_errors(scenario)._replace(distribution=distribution)
    return trials_of(scenario, errors, SEED, range(robots)).odds
