"""A motion that is likely to succeed on a robot which is only known within its tolerances, found within a time."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from typing import Generic, NamedTuple

from fivebar_bringup.odds.alternatives import Alternatives, Candidate, M, best_of_all
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.relief import most_relieved
from fivebar_bringup.odds.robot_errors import declared_errors
from fivebar_bringup.odds.trials import ROBOTS, SEED, trials_of
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
        odds: how many of the drawn robots make it; fewer robots than `ROBOTS` where the time was short.
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
    with stage("trying drawn robots"):
        # the odds of a given duration are stated; of another one they only have to tell whether others are tried
        failures = math.inf if given else (1.0 - required) * ROBOTS
        odds = trials_of(first.scenario, errors, SEED, range(ROBOTS), until, failures).odds
    found = LikelyMotion(*first, odds)
    if odds.successes + ROBOTS - odds.robots >= required * ROBOTS:
        # likely enough, or not known to be unlikely when the time was over
        return found
    expect_many_motions()
    with stage("trying other durations, time laws and ways"):
        motions = [first, *_in_other_durations(first, alternatives, until)]
        choice = best_of_all(motions, alternatives, errors, SEED, required, until)
    cut_short = time.monotonic() >= until
    if given:
        better = choice is not None and choice.odds.share > odds.share and choice.motion is not first
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
            robots = sorted(choice.robots, key=lambda robot: robot not in choice.failed)
            relief = most_relieved(chosen.scenario, errors, SEED, choice.odds, robots)
            more = f"; {relief}" if relief else ""
        raise InputError(
            f"the motion is not likely enough to succeed: at best, in {chosen.duration:.3g} s{how}, {choice.odds};"
            f" expected at least {required:.0%} (risk.success){more}"
        )
    return LikelyMotion(*chosen, choice.odds, chosen="" if chosen is first else _in_place_of(first, chosen))


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
