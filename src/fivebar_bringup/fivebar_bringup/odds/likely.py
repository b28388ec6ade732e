"""A motion that is likely to succeed on a robot which is only known within its tolerances, found within a time."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator
from typing import Generic, NamedTuple, TypeVar

from fivebar_bringup.odds.choice import likeliest
from fivebar_bringup.odds.declared import SEED
from fivebar_bringup.odds.drawn_robots import declared_errors
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.relief import most_relieved
from fivebar_bringup.odds.trials import ROBOTS, odds_of
from fivebar_bringup.scenario import Scenario
from fivebar_description.stages import stage
from fivebar_description.strict_yaml import InputError

OTHER_DURATIONS = (1.4, 0.7, 0.5, 0.35, 0.25)
"""Relative to the planner's first choice."""

M = TypeVar("M")


class Candidate(NamedTuple, Generic[M]):
    """A planned motion, and the scenario by which it is run."""

    motion: M
    scenario: Scenario

    @property
    def duration(self) -> float:
        """How long it takes (s)."""
        return sum(self.scenario.durations())


class Better(NamedTuple):
    """A duration (s) with better odds, and these."""

    duration: float
    odds: Odds


class LikelyMotion(NamedTuple, Generic[M]):
    """The motion that is made, with its odds.

    Attributes:
        motion, scenario: as in `Candidate`.
        odds: how many of the drawn robots make it; fewer robots than `ROBOTS` where the time was short.
        better: which other duration is likelier, where the duration was given.
    """

    motion: M
    scenario: Scenario
    odds: Odds
    better: Better | None = None

    @property
    def decided(self) -> bool:
        """Whether enough robots were tried to tell whether the motion is likely enough."""
        return self.odds.robots == ROBOTS


def likely_motion(
    first: Candidate[M],
    in_duration: Callable[[float], Candidate[M] | None],
    given: bool,
    until: float = math.inf,
) -> LikelyMotion[M]:
    """Return a motion with its odds: the first one where it is likely enough, else in the duration with the best odds.

    Args:
        first: as the planner chooses it, or as it was asked for.
        in_duration: returns the motion in another duration (s), None where there is none.
        given: keep the duration of the first one, and say which one would be better.
        until: when no further robot is tried (s on the steady clock).

    Raises:
        InputError: no duration is likely enough.
    """
    errors, required = declared_errors(first.scenario), first.scenario.risk.success
    with stage("trying drawn robots"):
        odds = odds_of(first.scenario, errors, SEED, range(ROBOTS), until)
    found = LikelyMotion(*first, odds)
    if odds.successes + ROBOTS - odds.robots >= required * ROBOTS:
        # likely enough, or not known to be unlikely when the time was over
        return found
    with stage("trying other durations"):
        motions = [first, *_others(in_duration, first.duration, until)]
        choice = likeliest(motions, lambda motion: motion.scenario, errors, SEED, until)
    if given:
        better = choice is not None and choice.odds.share > odds.share and choice.motion is not first
        return found._replace(better=Better(choice.motion.duration, choice.odds)) if choice and better else found
    if choice is None:
        raise InputError(
            f"the motion is not likely enough to succeed: in {first.duration:.3g} s {odds}; expected at least"
            f" {required:.0%} (risk.success), and no time was left to try other durations"
        )
    chosen = choice.motion
    if choice.odds.share < required:
        relief = most_relieved(chosen.scenario, errors, SEED, choice.odds) if until == math.inf else ""
        raise InputError(
            f"the motion is not likely enough to succeed: at best, in {chosen.duration:.3g} s, {choice.odds}; expected"
            f" at least {required:.0%} (risk.success){f'; {relief}' if relief else ''}"
        )
    return LikelyMotion(*chosen, choice.odds)


def _others(
    in_duration: Callable[[float], Candidate[M] | None], duration: float, until: float
) -> Iterator[Candidate[M]]:
    """Yield the motion in other durations than the first one (s), as far as it is feasible and there is time."""
    for factor in OTHER_DURATIONS:
        if time.monotonic() >= until:
            return
        found = in_duration(factor * duration)
        if found is not None:
            yield found
