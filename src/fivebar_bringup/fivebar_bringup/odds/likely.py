# SPDX-License-Identifier: Apache-2.0
"""A motion that is likely to succeed on a robot which is only known within its tolerances, found within a time."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from shlex import quote
from typing import Generic, NamedTuple

from fivebar_bringup.odds.alternatives import Alternatives, Candidate, M, best_of_all
from fivebar_bringup.odds.choice import Choice
from fivebar_bringup.odds.odds import Odds, failures_in_words
from fivebar_bringup.odds.relief import most_relieved
from fivebar_bringup.odds.robot_errors import RobotErrors, declared_errors
from fivebar_bringup.odds.trials import ROBOTS, SEED, STATED_ROBOTS, failures_allowed, trials_of
from fivebar_bringup.scenario import Scenario
from fivebar_control.compiling import expect_many_motions
from fivebar_description.stages import stage
from fivebar_description.strict_yaml import InputError

OTHER_DURATIONS = (1.4, 0.7, 0.5, 0.35, 0.25)
"""Relative to the planner's first choice."""


class Better(NamedTuple):
    """A motion with better odds than one whose duration is given.

    Attributes:
        duration: s.
        odds: its own.
        how: in what else it differs, in words; "" for nothing.
    """

    duration: float
    odds: Odds
    how: str = ""


class LikelyMotion(NamedTuple, Generic[M]):
    """The motion that is made, with its odds.

    Attributes:
        motion, scenario: as in `Candidate`.
        odds: how many of the drawn robots make it, none of which had a part in accepting it; fewer robots than
            `ROBOTS` where the time was short.
        better: what is likelier, where the duration was given.
        chosen: in what it differs from the planner's first choice, in words; "" for nothing.
    """

    motion: M
    scenario: Scenario
    odds: Odds
    better: Better | None = None
    chosen: str = ""

    @property
    def decided(self) -> bool:
        """Whether enough robots were tried to tell whether the motion is likely enough."""
        return self.odds.robots == ROBOTS


def likely_motion(
    first: Candidate[M], alternatives: Alternatives[M], given: bool, until: float = math.inf
) -> LikelyMotion[M]:
    """Return a motion with its odds: the first one where it is likely enough, else the one with the best odds.

    Args:
        first: as the planner chooses it, or as it was asked for.
        alternatives: what else it might be.
        given: keep the duration of the first one, and say what would be better.
        until: when no further robot is tried (s on the steady clock).

    Raises:
        InputError: none is likely enough.
    """
    errors, required = declared_errors(first.scenario), first.scenario.risk.success

    def stated(motion: Candidate[M]) -> LikelyMotion[M]:
        return LikelyMotion(*motion, trials_of(motion.scenario, errors, SEED, STATED_ROBOTS, until).odds)

    with stage("trying drawn robots"):
        odds = trials_of(first.scenario, errors, SEED, range(ROBOTS), until, failures_allowed(required)).odds
        # likely enough, or not known to be unlikely when the time was over
        likely = odds.successes + ROBOTS - odds.robots >= required * ROBOTS
        if likely:
            return stated(first)
    expect_many_motions()
    with stage("trying other durations, time laws and ways"):
        motions = [first, *_in_other_durations(first, alternatives, until)]
        choice = best_of_all(motions, alternatives, errors, SEED, required, until)
    cut_short = time.monotonic() >= until
    if given:
        found = stated(first)
        better = choice is not None and choice.odds.share > found.odds.share and choice.motion is not first
        if not (choice and better):
            return found
        other = choice.motion
        return found._replace(better=Better(other.duration, choice.odds, other.how_other_than(first)))
    if choice is None:
        raise InputError(
            f"the motion is not likely enough to succeed: in {first.duration:.3g} s {odds}; expected at least"
            f" {required:.0%} (risk.success), and no time was left to try others (risk.odds_time)"
        )
    chosen = choice.motion
    how = chosen.how_other_than(first)
    if choice.odds.share < required:
        more = ", and no time was left to try more (risk.odds_time)" if cut_short else ""
        if until == math.inf:
            more = f"; {_what_helps(choice, errors)}"
        causes = failures_in_words(choice.failed.values(), chosen.scenario.error_tolerance)
        raise InputError(
            f"the motion is not likely enough to succeed: at best, in {chosen.duration:.3g} s{how}, {choice.odds};"
            f" expected at least {required:.0%} (risk.success); failed: {causes}{more}"
        )
    return stated(chosen)._replace(chosen="" if chosen is first else _in_place_of(first, chosen))


def _what_helps(choice: Choice[Candidate[M]], errors: RobotErrors) -> str:
    """Return what would make a refused motion likelier, and the command that says more."""
    scenario = choice.motion.scenario
    robots = sorted(choice.robots, key=lambda robot: robot not in choice.failed)
    relief = most_relieved(scenario, errors, SEED, choice.odds, robots)
    return f"{relief or 'nothing alone raises that'}; more: fivebar assess {quote(scenario.robot)}"


def _in_place_of(first: Candidate[M], chosen: Candidate[M]) -> str:
    """Return what was chosen in place of the first motion, in words."""
    before, after = (f"{one.duration:.3g} s" for one in (first, chosen))
    return f"{after}{chosen.how_other_than(first)}{f', not {before}' if before != after else ''}"


def _in_other_durations(first: Candidate[M], alternatives: Alternatives[M], until: float) -> Iterator[Candidate[M]]:
    """Yield the motion in other durations than the first one, as far as it is feasible and there is time."""
    for factor in OTHER_DURATIONS:
        if time.monotonic() >= until:
            return
        found = alternatives.in_duration(first, factor * first.duration)
        if found is not None:
            yield found
