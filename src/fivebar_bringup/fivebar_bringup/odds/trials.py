"""Tries a motion on drawn robots, on the compiled engine."""

from __future__ import annotations

from collections.abc import Iterable

from fivebar_bringup.odds.drawn_robots import with_drawn_robot
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.robot_errors import RobotErrors
from fivebar_bringup.odds.success import shortcomings
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import case_of, sampled
from fivebar_bringup.simulation.uncompiled import crossing

ROBOTS = 24
"""Robots on which a motion is tried for the odds that are stated."""

OTHER_ROBOTS = range(ROBOTS, 2 * ROBOTS)
"""Robots that have no part in a choice by the first ones."""


def odds_of(scenario: Scenario, errors: RobotErrors, seed: int, robots: Iterable[int]) -> Odds:
    """Return the odds of a scenario's motion.

    Args:
        scenario: with the motion, the controller and what all its robots have in common.
        errors: within which they are drawn.
        seed: of the draws.
        robots: their numbers; with equal seeds and numbers different motions are tried on the same robots.

    Raises:
        PlanRefused: the motion cannot be made.
    """
    plan = scenario.plan()
    samples = sampled(scenario.five_bar(), plan, scenario.rate_hz, scenario.lead_samples)
    planned = plan.path.samples(scenario.rate_hz) + 1
    times = [one.time for one in plan.crossings] or [0.5 * plan.path.duration]
    successes = tried = 0
    for number in robots:
        # a push meets one of the crossings
        drawn = with_drawn_robot(scenario, errors, seed, number, times[number % len(times)])
        outcome = crossing(case_of(drawn, stop_at_fault=True), samples)
        missed = shortcomings(outcome, planned, len(plan.crossings), scenario.error_tolerance)
        successes += not missed
        tried += 1
    return Odds(successes, tried)
