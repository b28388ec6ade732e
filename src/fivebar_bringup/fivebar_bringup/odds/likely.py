# SPDX-License-Identifier: Apache-2.0
"""A motion that is likely to succeed on a robot which is only known within its tolerances, found within a time."""

from __future__ import annotations

import math
import time
from itertools import chain
from shlex import quote

from fivebar_bringup.odds.alternatives import Alternatives, first_or_best
from fivebar_bringup.odds.choice import Choice
from fivebar_bringup.odds.odds import failures_in_words
from fivebar_bringup.odds.planned_motion import M, PlannedMotion
from fivebar_bringup.odds.relief import most_relieved
from fivebar_bringup.odds.robot_errors import RobotErrors, declared_errors
from fivebar_bringup.odds.trials import DECIDING_ROBOTS, SEED, STATED_ROBOTS, failures_allowed, trials_of
from fivebar_description.stages import stage
from fivebar_description.strict_yaml import InputError

OTHER_DURATIONS = (1.4, 0.7, 0.5, 0.35, 0.25)
"""Relative to the planner's first choice."""


def with_stated_odds(
    motion: PlannedMotion[M], errors: RobotErrors, seed: int, until: float = math.inf, likely: bool = True
) -> PlannedMotion[M]:
    """Return a motion with its odds on robots that had no part in accepting it."""
    with stage("trying drawn robots"):
        odds = trials_of(motion.scenario, errors, seed, STATED_ROBOTS, until).odds
    return motion._replace(odds=odds, likely=likely)


def likely_motion(
    first: PlannedMotion[M], alternatives: Alternatives[M], keeps_duration: bool, until: float = math.inf
) -> PlannedMotion[M]:
    """Return a motion with its odds: the first one where it is likely enough, else the one with the best odds.

    The odds are those on fewer robots than `ROBOTS` where the time was short: then they do not tell enough.

    Args:
        first: as the planner chooses it, or as it was asked for.
        alternatives: what else it might be.
        keeps_duration: keep the duration of the first one, and say what would be better.
        until: when no further robot is tried (s on the steady clock).

    Raises:
        InputError: none is likely enough.
    """
    errors = declared_errors(first.scenario)
    durations = (factor * first.duration for factor in OTHER_DURATIONS)
    motions = chain([first], alternatives.in_durations(first, durations, until))
    choice = first_or_best(first, motions, alternatives, errors, SEED, until, failures_allowed(first.required))
    cut_short = time.monotonic() >= until
    best = choice.motion
    how = best.how_other_than(first)
    if keeps_duration:
        kept = with_stated_odds(first, errors, SEED, until, choice.motion is first and choice.likely)
        if best is first or kept.odds is None or choice.odds.share <= kept.odds.share:
            return kept
        return kept._replace(better=best._replace(odds=choice.odds, chosen=how))
    if choice.likely:
        chosen = "" if best is first else _in_place_of(first, best)
        return with_stated_odds(best, errors, SEED, until)._replace(chosen=chosen)
    refusal = "the motion is not likely enough to succeed:"
    expected = f"expected at least {first.required:.0%} (risk.success)"
    if choice.robots == DECIDING_ROBOTS:
        raise InputError(
            f"{refusal} in {first.duration:.3g} s {choice.odds}; {expected}, and no time was left to try others"
            " (risk.odds_time)"
        )
    more = ", and no time was left to try more (risk.odds_time)" if cut_short else ""
    if until == math.inf:
        more = f"; {_what_helps(choice, errors)}"
    causes = failures_in_words(choice.failed.values(), best.scenario.error_tolerance)
    raise InputError(
        f"{refusal} at best, in {best.duration:.3g} s{how}, {choice.odds}; {expected}; failed: {causes}{more}"
    )


def _what_helps(choice: Choice[M], errors: RobotErrors) -> str:
    """Return what would make a refused motion likelier, and the command that says more."""
    scenario = choice.motion.scenario
    robots = sorted(choice.robots, key=lambda robot: robot not in choice.failed)
    relief = most_relieved(scenario, errors, SEED, choice.odds, robots)
    return f"{relief or 'nothing alone raises that'}; more: fivebar assess {quote(scenario.robot)}"


def _in_place_of(first: PlannedMotion[M], chosen: PlannedMotion[M]) -> str:
    """Return what was chosen in place of the first motion, in words."""
    before, after = (f"{motion.duration:.3g} s" for motion in (first, chosen))
    return f"{after}{chosen.how_other_than(first)}{f', not {before}' if before != after else ''}"
