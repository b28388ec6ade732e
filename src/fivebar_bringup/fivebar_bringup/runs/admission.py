"""Admits a scenario to a run: what runs a scenario screens it first, as a request for a motion is screened."""

from __future__ import annotations

import math
from collections.abc import Mapping
from itertools import pairwise
from typing import TYPE_CHECKING, Any, NamedTuple

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import NONE, load_scenario
from fivebar_control.planning.advice import advice, concerns_tolerances, judge_of
from fivebar_control.planning.feasibility import displaced, screen_run
from fivebar_control.planning.figures import LOADS, Feasibility
from fivebar_control.planning.pacing import Borne, longest_within
from fivebar_control.scenario.motion_limits import scenario_limits
from fivebar_control.trajectory.planner import OPTIMAL, Plan, PlanRefused
from fivebar_description.stages import stage

if TYPE_CHECKING:
    from fivebar_bringup.odds.odds import Odds


def load_admitted(name_or_path: str, parameters: Mapping[str, Any] = NONE) -> Scenario:
    """Read a scenario as `load_scenario` does, and screen its motion.

    Raises:
        InputError: there is no such scenario, it is malformed, its motion is refused, or the screen refuses it and the
            scenario does not say `force: true`.
    """
    return _admitted(name_or_path, parameters).scenario


class Admitted(NamedTuple):
    """A scenario that may run, and how many of the drawn robots make its motion; None where that is not known."""

    scenario: Scenario
    odds: Odds | None

    @property
    def kept(self) -> dict[str, Any] | None:
        """The odds as plain numbers, to be kept with a run."""
        return None if self.odds is None else self.odds.as_dict()


def load_with_odds(name_or_path: str) -> Admitted:
    """Read and screen a scenario as `load_admitted` does, and find its odds where its robot declares something.

    Raises:
        InputError: as `load_admitted`.
    """
    scenario, odds = _admitted(name_or_path, NONE)
    # a law that is not compiled takes a minute for all robots
    if odds is None and _has_odds(scenario) and scenario.scheme().compiles:
        odds = _tried(scenario)
    return Admitted(scenario, odds)


def _admitted(name_or_path: str, parameters: Mapping[str, Any]) -> Admitted:
    scenario = load_scenario(name_or_path, parameters)
    try:
        return Admitted(scenario, refuse_unfit(scenario))
    except PlanRefused as refusal:
        raise PlanRefused(f"{name_or_path}: {refusal}") from refusal


def refuse_unfit(scenario: Scenario) -> Odds | None:
    """Raise where the screen refuses a scenario's motion; return its odds where these have decided.

    Where the screen refuses the motion for the declared loads alone, the odds decide: how many robots make it that are
    drawn within what is declared.

    Raises:
        PlanRefused: a figure is beyond its limit; the message gives each with place and limit.
    """
    if scenario.force:
        return None
    plan = scenario.plan()
    verdict = screened(scenario, plan)
    if verdict.feasible:
        return None
    odds = _odds(scenario, plan) if _only_loads(verdict) else None
    if odds is not None and odds.share >= scenario.risk.success:
        return odds
    help_ = _advice(scenario, plan, verdict)
    within = f"; within the limits {help_}" if help_ else ""
    unlikely = "" if odds is None else f"; {odds}, expected are at least {scenario.risk.success:.0%}"
    raise PlanRefused(
        f"{'; '.join(verdict.reasons)}{within}{unlikely} (with force: true the scenario runs all the same)"
    )


def _only_loads(verdict: Feasibility) -> bool:
    return [figure.name for figure in verdict.figures if not figure.kept] == [LOADS]


def _odds(scenario: Scenario, plan: Plan) -> Odds | None:
    """Return the odds of a motion whose loads the screen does not accept; None where they are not known."""
    # where the screen finds the loads, it has not predicted the run
    possible = _has_odds(scenario) and screened(scenario, plan, judge_loads=False).feasible
    return _tried(scenario) if possible else None


def _has_odds(scenario: Scenario) -> bool:
    if not scenario.declares_errors:
        return False
    # here, because few scenarios declare any
    from fivebar_bringup.odds.robot_errors import has_odds

    return has_odds(scenario)


def _tried(scenario: Scenario) -> Odds:
    # here, because the compiled engine takes long to load
    from fivebar_bringup.odds.trials import declared_odds

    with stage("trying drawn robots"):
        return declared_odds(scenario)


def _advice(scenario: Scenario, plan: Plan, verdict: Feasibility) -> str:
    """Return what would make a motion feasible: another time law, or what the tolerances or the loads ask for."""
    found = _quicker(scenario) if _only_loads(verdict) else _within_tolerances(scenario, plan, verdict)
    return ", or ".join(words for words in (found, _by_least_torque(scenario)) if words)


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
    given = scenario.sensing()
    if given is None or not concerns_tolerances(verdict):
        return ""

    def possible(factor: float) -> bool:
        durations = tuple(duration / factor for duration in scenario.durations())
        return _is_feasible(scenario.model_copy(update={"segment_duration": durations}))

    limits = scenario_limits(scenario, plan)
    judge = judge_of(scenario.five_bar(), plan, scenario.rate_hz, scenario.tuned(), limits)
    found = advice(verdict, plan.path, given, judge, possible)
    return f"with {found}" if found else ""


def _quicker(scenario: Scenario) -> str:
    """Return how quick a motion would have to be for the loads: the speeds, and whether that is feasible."""
    if scenario.working_modes is not None or scenario.rounded:
        return ""
    durations, words = [], []
    for number, (ends, duration) in enumerate(zip(pairwise(scenario.waypoints), scenario.durations(), strict=True)):
        segment = scenario.model_copy(update={"waypoints": ends, "segment_duration": duration})
        found = _longest_bearing(segment)
        if not found.enough:
            return ""
        borne = duration if found.duration == duration else math.floor(1e3 * found.duration) / 1e3
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
        limits = scenario_limits(segment, plan)
        moved = displaced(segment.five_bar(), plan, segment.rate_hz, segment.tuned(), limits, limits.certain_loads)
        return moved.value - moved.limit

    return longest_within(excess, segment.durations()[0])


def screened(scenario: Scenario, plan: Plan, judge_loads: bool = True) -> Feasibility:
    """Return the screen's verdict on a scenario with its plan, with or without a judgement of the declared loads."""
    limits = scenario_limits(scenario, plan)
    if not judge_loads:
        limits = limits.without_loads()
    return screen_run(scenario.five_bar(), plan, scenario.rate_hz, scenario.tuned(), limits, scenario.sensing())
