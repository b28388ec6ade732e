# SPDX-License-Identifier: Apache-2.0
"""A requested motion that is likely to succeed on a robot which is only known within its tolerances."""

from __future__ import annotations

from collections.abc import Iterable

from fivebar_bringup.motions.request import (
    Request,
    asked_scenario,
    plan_request,
    refuse_malformed,
    scenario_of,
    task_of_request,
)
from fivebar_bringup.odds.planned_motion import PlannedMotion
from fivebar_bringup.odds.robot_errors import has_odds
from fivebar_control.planning.alternative_courses import TimedCourse, courses_elsewhere
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import Transfer, transfer_along
from fivebar_description.strict_yaml import InputError


def plan_likely(request: Request) -> PlannedMotion[Transfer]:
    """Plan a request, and where tolerances or loads are declared, choose duration, time law and way by the odds.

    A duration that is given is kept.

    Raises:
        InputError: a value is impossible, there is no feasible motion, or none that is likely enough; says why.
    """
    refuse_malformed(request)
    drawn = has_odds(asked_scenario(request))
    transfer = plan_request(request, judge_loads=not drawn)
    first = PlannedMotion(transfer, scenario_of(request, transfer))
    if not drawn:
        return first
    # here, because the compiled engine takes long to load
    from fivebar_bringup.odds.alternatives import Alternatives
    from fivebar_bringup.odds.likely import likely_motion

    if request.trajectory:
        # its rows say where it is when, so that nothing else may be chosen for its odds
        kept = Alternatives[Transfer](lambda timed: None, lambda course: (), lambda: (), request.rate_hz)
        return likely_motion(first, kept, True)
    task = task_of_request(request, judge_loads=False)

    def planned(timed: TimedCourse) -> PlannedMotion[Transfer] | None:
        try:
            along = transfer_along(task, timed)
            return PlannedMotion(along, scenario_of(request, along))
        except InputError:
            return None

    def elsewhere() -> Iterable[TimedCourse]:
        ends = transfer.waypoints[0], transfer.waypoints[-1]
        return () if request.via else courses_elsewhere(task, *ends, transfer.plan)

    alternatives = Alternatives(planned, lambda course: course.by_other_laws(task.robot), elsewhere, task.rate_hz)
    return likely_motion(first, alternatives, not isinstance(request.duration, Speed))
