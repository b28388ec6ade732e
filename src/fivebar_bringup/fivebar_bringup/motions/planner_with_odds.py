# SPDX-License-Identifier: Apache-2.0
"""Plans requests of a running graph, and the moves of a program, so that they are likely to succeed."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable
from contextlib import suppress
from typing import Any

from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.planned_motion import PlannedMotion
from fivebar_bringup.odds.robot_errors import has_odds
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_control.compiling import expect_many_motions
from fivebar_control.planning.alternative_courses import TimedCourse, chart_for, courses_elsewhere
from fivebar_control.planning.order_planning import plan_once, plan_timed, task_of
from fivebar_control.planning.orders import Conditions, Order, Planned, PlanningRequest
from fivebar_control.scenario.goal_conditions import conditions_of
from fivebar_description.strict_yaml import InputError


def planner_of(conditions: Conditions) -> Callable[[Order], Planned]:
    """Return the planner of requests under some conditions, with odds where the run's file has what they need.

    Everything that it needs is loaded before it returns.
    """
    try:
        scenario = load_scenario(conditions.file)
        as_in_file = conditions_of(scenario)._replace(held=conditions.held)
    except InputError as error:
        return _without_odds(conditions, f"the run's file cannot be used: {error}")
    if not has_odds(scenario):
        return lambda order: plan_once(conditions, order)
    bare = conditions._replace(planner="", file="", odds_time=math.inf)
    if bare != as_in_file:
        return _without_odds(conditions, "the settings are not those of the run's file")
    orders = PlannerWithOdds(scenario, bare, conditions.odds_time)
    orders.warm_up()
    return orders.plan


def _without_odds(conditions: Conditions, reason: str) -> Callable[[Order], Planned]:
    return lambda order: plan_once(conditions, order)._replace(odds={"unknown": reason})


class PlannerWithOdds:
    """Plans requests by the odds of a scenario's robot, each once unless the clock has cut its search short."""

    def __init__(self, scenario: Scenario, conditions: Conditions, odds_time: float = math.inf) -> None:
        """Plan for a robot that declares something to draw from.

        Args:
            scenario: with the robot, its controller and its sensors; the motions are those of the requests.
            conditions: by which requests are judged.
            odds_time: longest time for the odds of a request (s); then the screen decides, declared loads included.
        """
        self._scenario, self._conditions, self._odds_time = scenario, conditions, odds_time
        # where the odds decide, no displacement by the declared loads is too large
        self._without_loads = conditions._replace(risk=conditions.risk._replace(load_share=math.inf))
        self._known: dict[PlanningRequest, Planned] = {}

    def warm_up(self) -> None:
        """Load what the first odds need, and by the clock what would take some of their time: map and machine code."""
        from fivebar_bringup.odds.trials import declared_odds

        declared_odds(self._scenario, 1)
        if math.isfinite(self._odds_time):
            expect_many_motions()
            first, second = self._scenario.waypoints[:2]
            request = PlanningRequest(first, self._scenario.working_mode, second, 0, 0.0)
            plan_once(self._without_loads, request)
            # what speaks against any motion, each request is told
            with suppress(InputError):
                chart_for(task_of(self._conditions, request))

    def plan(self, order: Order) -> Planned:
        """Plan a request; a motion is likely enough, or its odds are not known for want of time, which is then said."""
        if not isinstance(order, PlanningRequest):
            return plan_once(self._conditions, order)
        known = self._known.get(order)
        if known is None:
            known, lasting = self._planned(order)
            if lasting:
                self._known[order] = known
        return known

    def _planned(self, order: PlanningRequest) -> tuple[Planned, bool]:
        """Return the answer to a request, and whether more time would not change it."""
        # here, because the compiled engine takes long to load
        from fivebar_bringup.odds.alternatives import Alternatives
        from fivebar_bringup.odds.likely import likely_motion
        from fivebar_bringup.odds.trials import ROBOTS

        conditions = self._without_loads
        first = plan_once(conditions, order)
        if first.refused:
            return first, True
        task = task_of(conditions, order)

        def planned(timed: TimedCourse) -> PlannedMotion[Planned] | None:
            motion = plan_timed(conditions, order, timed)
            return None if motion.refused else PlannedMotion(motion, self._scenario_of(order, motion))

        candidate = PlannedMotion(first, self._scenario_of(order, first))
        until = time.monotonic() + self._odds_time

        def elsewhere() -> Iterable[TimedCourse]:
            if order.via:
                return ()
            return courses_elsewhere(task, order.start, order.goal, candidate.scenario.plan(), until)

        alternatives = Alternatives(planned, lambda course: course.by_other_laws(task.robot), elsewhere, task.rate_hz)
        try:
            likely = likely_motion(candidate, alternatives, order.duration > 0.0, until)
        except InputError as refusal:
            # a search that the clock has cut short may find more the next time
            return Planned(str(refusal)), time.monotonic() < until
        tried, better = likely.odds or Odds(), likely.better
        odds: dict[str, Any] = likely.known_odds or {} if tried.robots else {}
        if better is not None and better.odds is not None:
            odds["better"] = {"duration_s": better.duration, "how": better.chosen, **better.odds.as_dict()}
        if tried.robots == ROBOTS:
            return likely.motion._replace(odds=odds), True
        unknown = f"{tried.robots} robots could be tried within {self._odds_time:g} s (risk.odds_time)"
        judged = plan_once(self._conditions, order)
        if judged.refused:
            return judged._replace(refused=f"{judged.refused}; the odds are not known: {unknown}"), False
        return judged._replace(odds={"unknown": unknown}), False

    def together(self, orders: Iterable[PlanningRequest]) -> Odds:
        """Return how many robots make the motions of all these requests, on robots that had no part in a choice."""
        from fivebar_bringup.odds.robot_errors import declared_errors
        from fivebar_bringup.odds.trials import SEED, STATED_ROBOTS, trials_of

        errors = declared_errors(self._scenario)
        failed: set[int] = set()
        for order in dict.fromkeys(orders):
            scenario = self._scenario_of(order, self.plan(order))
            failed |= trials_of(scenario, errors, SEED, STATED_ROBOTS).failed.keys()
        return Odds(len(STATED_ROBOTS) - len(failed), len(STATED_ROBOTS))

    def _scenario_of(self, order: PlanningRequest, planned: Planned) -> Scenario:
        """Return the scenario that makes a planned motion alone, by a robot that carries what the request says."""
        course = planned.course
        update = {
            "working_mode": order.working_mode,
            "waypoints": course.waypoints,
            "segment_duration": planned.durations,
            "time_law": course.time_law,
            "blend_radius": course.blend_radius if course.rounded else 0.0,
        }
        return self._scenario.model_copy(update=update).carrying(order.payload)
