"""A requested motion that is likely to succeed on a robot which is only known within its tolerances."""

from __future__ import annotations

from typing import Any, NamedTuple

from fivebar_bringup.motions.request import Request, asked_scenario, plan_request, refuse_malformed, scenario_of
from fivebar_bringup.odds.drawn_robots import declared_errors, has_odds
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import Transfer
from fivebar_description.stages import stage
from fivebar_description.strict_yaml import InputError

OTHER_DURATIONS = (1.4, 0.7, 0.5, 0.35, 0.25)
"""Relative to the planner's first choice."""


class LikelyTransfer(NamedTuple):
    """A planned transfer with its odds.

    Attributes:
        transfer: the motion.
        scenario: by which it is run.
        odds: how many of the drawn robots make it; None where the robot's file declares nothing to draw from.
        better: which duration (s) would have better odds, and these, where the duration was given; else None.
    """

    transfer: Transfer
    scenario: Scenario
    odds: Odds | None = None
    better: tuple[float, Odds] | None = None

    @property
    def known_odds(self) -> dict[str, Any] | None:
        """The odds as plain numbers, to be kept with a run."""
        return None if self.odds is None else self.odds.as_dict()


def plan_likely(request: Request) -> LikelyTransfer:
    """Plan a request, and where tolerances or loads are declared, choose its duration by the odds.

    A duration that is given is kept.

    Raises:
        InputError: a value is impossible, there is no feasible motion, or none that is likely enough; says why.
    """
    refuse_malformed(request)
    drawn = has_odds(asked_scenario(request))
    transfer = plan_request(request, judge_loads=not drawn)
    first = scenario_of(request, transfer)
    if not drawn:
        return LikelyTransfer(transfer, first)
    # here, because the compiled engine takes long to load
    from fivebar_bringup.odds.choice import likeliest
    from fivebar_bringup.odds.declared import SEED, declared_odds
    from fivebar_bringup.odds.relief import most_relieved

    errors = declared_errors(first)
    with stage("trying drawn robots"):
        found = LikelyTransfer(transfer, first, declared_odds(first))
    required = first.risk.success
    assert found.odds is not None
    if found.odds.share >= required:
        return found
    with stage("trying other durations"):
        motions = [found, *_others(request, sum(transfer.durations))]
        choice = likeliest(motions, lambda motion: motion.scenario, errors, SEED)
    assert choice is not None
    chosen = choice.motion
    duration = sum(chosen.transfer.durations)
    if not isinstance(request.duration, Speed):
        better = choice.odds.share > found.odds.share and duration != request.duration
        return found._replace(better=(duration, choice.odds) if better else None)
    if choice.odds.share < required:
        relief = most_relieved(chosen.scenario, errors, SEED, choice.odds)
        raise InputError(
            f"the motion is not likely enough to succeed: at best, in {duration:.3g} s, {choice.odds}; expected at"
            f" least {required:.0%} (risk.success){f'; {relief}' if relief else ''}"
        )
    return chosen._replace(odds=choice.odds)


def _others(request: Request, duration: float) -> list[LikelyTransfer]:
    """Return the feasible motions in other durations than the one of the first choice (s)."""
    found = []
    for factor in OTHER_DURATIONS:
        other = request._replace(duration=factor * duration)
        try:
            transfer = plan_request(other, judge_loads=False)
        except InputError:
            continue
        found.append(LikelyTransfer(transfer, scenario_of(other, transfer)))
    return found
