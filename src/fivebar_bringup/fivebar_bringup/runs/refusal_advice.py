# SPDX-License-Identifier: Apache-2.0
"""Changes of a scenario that the screen refuses with which it would accept the motion."""

from __future__ import annotations

import math
from itertools import pairwise

from fivebar_bringup.runs.screening import screened
from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.advice import advice, concerns_tolerances, judge_of
from fivebar_control.planning.feasibility import displaced
from fivebar_control.planning.figures import Feasibility
from fivebar_control.planning.pacing import Borne, longest_within
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.motion_limits import scenario_limits
from fivebar_control.scenario.sensors import sensing_if_estimated
from fivebar_control.trajectory.planner import Plan, PlanRefused
from fivebar_control.trajectory.time_laws import OPTIMAL

HIGHER_RATES = (200, 500)
"""Rates (Hz) that are tried in place of a lower one."""


def advice_for(scenario: Scenario, plan: Plan, verdict: Feasibility, only_loads: bool) -> str:
    """Return what would make a motion feasible: another time law, or what the tolerances or the loads ask for."""
    nearest = _quicker(scenario) if only_loads else _within_tolerances(scenario, plan, verdict)
    return ", or ".join(words for words in (nearest, _by_least_torque(scenario), _at_higher_rate(scenario)) if words)


def _at_higher_rate(scenario: Scenario) -> str:
    """Return the first higher rate of the controllers that would do, where the present one is low."""
    for rate_hz in (rate for rate in HIGHER_RATES if rate > scenario.rate_hz):
        if _is_feasible(scenario.model_copy(update={"rate_hz": rate_hz})):
            return f"with rate_hz: {rate_hz}"
    return ""


def _by_least_torque(scenario: Scenario) -> str:
    """Return whether the time law of least torque would do, in the same duration."""
    if scenario.time_law == OPTIMAL or scenario.working_modes is not None:
        return ""
    feasible = _is_feasible(scenario.model_copy(update={"time_law": OPTIMAL}))
    return f"with time_law: {OPTIMAL}" if feasible else ""


def _is_feasible(scenario: Scenario) -> bool:
    try:
        return screened(scenario, scenario.plan()).feasible
    except PlanRefused:
        return False


def _within_tolerances(scenario: Scenario, plan: Plan, verdict: Feasibility) -> str:
    """Return what would make a motion feasible that nothing but the tolerances of the robot forbids."""
    sensing = sensing_if_estimated(scenario)
    if sensing is None or not concerns_tolerances(verdict):
        return ""

    def possible(factor: float) -> bool:
        durations = tuple(duration / factor for duration in scenario.durations())
        return _is_feasible(scenario.model_copy(update={"segment_duration": durations}))

    limits = scenario_limits(scenario, plan)
    judge = judge_of(scenario.five_bar(), plan, scenario.rate_hz, tuned_controller(scenario), limits)
    words = advice(verdict, plan.path, sensing, judge, possible)
    return f"with {words}" if words else ""


def _quicker(scenario: Scenario) -> str:
    """Return how quick a motion would have to be for the loads: the speeds, and whether that is feasible."""
    if scenario.working_modes is not None or scenario.rounded:
        return ""
    durations, words = [], []
    for number, (ends, duration) in enumerate(zip(pairwise(scenario.waypoints), scenario.durations(), strict=True)):
        segment = scenario.model_copy(update={"waypoints": ends, "segment_duration": duration})
        bearable = _longest_bearing(segment)
        if not bearable.enough:
            return ""
        borne = duration if bearable.duration == duration else math.floor(1e3 * bearable.duration) / 1e3
        durations.append(borne)
        if borne < duration:
            plan = segment.model_copy(update={"segment_duration": borne}).plan()
            there = plan.path.at(plan.crossings[0].time)
            which = f" for segment {number + 1}" if len(scenario.waypoints) > 2 else ""
            words.append(
                f"at more than {math.hypot(there.vx, there.vy):.2g} m/s there, with a duration of {borne:g} s{which}"
            )
    if not words:
        # each segment by itself bears the loads, only the whole motion does not
        return ""
    quicker = scenario.model_copy(update={"segment_duration": tuple(durations)})
    try:
        reasons = screened(quicker, quicker.plan()).reasons
    except PlanRefused as refusal:
        reasons = [str(refusal)]
    return " and ".join(words) + (f" (then, however, {'; '.join(reasons)})" if reasons else "")


def _longest_bearing(segment: Scenario) -> Borne:
    """Return the longest duration, at most its own, in which a single segment bears the declared loads."""

    def excess(duration: float) -> float:
        plan = segment.model_copy(update={"segment_duration": duration}).plan()
        if not plan.crossings:
            return 0.0
        limits, tuned = scenario_limits(segment, plan), tuned_controller(segment)
        moved = displaced(segment.five_bar(), plan, segment.rate_hz, tuned, limits, limits.certain_loads)
        return moved.value - moved.limit

    return longest_within(excess, segment.durations()[0])
