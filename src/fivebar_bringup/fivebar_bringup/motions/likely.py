"""A requested motion that is likely to succeed on a robot which is only known within its tolerances."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

from fivebar_bringup.motions.request import Request, asked_scenario, plan_request, refuse_malformed, scenario_of
from fivebar_bringup.odds.drawn_robots import has_odds
from fivebar_bringup.odds.odds import Odds, kept_odds
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import Transfer
from fivebar_description.strict_yaml import InputError

if TYPE_CHECKING:
    from fivebar_bringup.odds.likely import Better, Candidate


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
    better: Better | None = None

    @property
    def known_odds(self) -> dict[str, Any] | None:
        """The odds as plain numbers, to be kept with a run."""
        return kept_odds(self.odds)


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
    from fivebar_bringup.odds.likely import Candidate, likely_motion

    def in_duration(duration: float) -> Candidate[Transfer] | None:
        other = request._replace(duration=duration)
        try:
            found = plan_request(other, judge_loads=False)
        except InputError:
            return None
        return Candidate(found, scenario_of(other, found))

    given = not isinstance(request.duration, Speed)
    return LikelyTransfer(*likely_motion(Candidate(transfer, first), in_duration, given))
