# SPDX-License-Identifier: Apache-2.0
"""A requested motion that is likely to succeed on a robot which is only known within its tolerances."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any, NamedTuple

from fivebar_bringup.motions.request import (
    Request,
    asked_scenario,
    plan_request,
    refuse_malformed,
    scenario_of,
    task_of_request,
)
from fivebar_bringup.odds.odds import Odds, kept_odds
from fivebar_bringup.odds.robot_errors import has_odds
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.alternative_courses import TimedCourse, courses_elsewhere
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import Transfer, transfer_along
from fivebar_description.strict_yaml import InputError

if TYPE_CHECKING:
    from fivebar_bringup.odds.likely import Better


class LikelyTransfer(NamedTuple):
    """A planned transfer with its odds.

    Attributes:
        transfer: the motion.
        scenario: by which it is run.
        odds: how many of the drawn robots make it; None where the robot's file declares nothing to draw from.
        better: what would have better odds, where the duration was given; else None.
        chosen: in what it differs from the planner's first choice, in words; "" for nothing.
    """

    transfer: Transfer
    scenario: Scenario
    odds: Odds | None = None
    better: Better | None = None
    chosen: str = ""

    @property
    def known_odds(self) -> dict[str, Any] | None:
        """The odds as plain numbers, to be kept with a run."""
        return kept_odds(self.odds, self.chosen)


def plan_likely(request: Request) -> LikelyTransfer:
    """Plan a request, and where tolerances or loads are declared, choose duration, time law and way by the odds.

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
    from fivebar_bringup.odds.alternatives import Alternatives, Candidate
    from fivebar_bringup.odds.likely import likely_motion

    if request.trajectory:
        # its rows say where it is when, so that nothing else may be chosen for its odds
        kept = Alternatives[Transfer](lambda timed: None, lambda course: (), lambda: (), request.rate_hz)
        return LikelyTransfer(*likely_motion(Candidate(transfer, first), kept, True))
    task = task_of_request(request, judge_loads=False)

    def planned(timed: TimedCourse) -> Candidate[Transfer] | None:
        try:
            found = transfer_along(task, timed)
            return Candidate(found, scenario_of(request, found))
        except InputError:
            return None

    def elsewhere() -> Iterable[TimedCourse]:
        ends = transfer.waypoints[0], transfer.waypoints[-1]
        return () if request.via else courses_elsewhere(task, *ends, transfer.plan)

    alternatives = Alternatives(planned, lambda course: course.by_other_laws(task.robot), elsewhere, task.rate_hz)
    given = not isinstance(request.duration, Speed)
    return LikelyTransfer(*likely_motion(Candidate(transfer, first), alternatives, given))
