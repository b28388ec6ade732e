# SPDX-License-Identifier: Apache-2.0
"""Admits a scenario to a run: what runs a scenario screens it first, as a request for a motion is screened."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, NamedTuple

from fivebar_bringup.runs.screening import screened
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import NONE, load_scenario
from fivebar_control.planning.figures import LOADS, Feasibility
from fivebar_control.trajectory.planner import Plan, PlanRefused
from fivebar_description.stages import stage

if TYPE_CHECKING:
    from fivebar_bringup.odds.odds import Odds
    from fivebar_bringup.odds.trials import Trials


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


def load_with_odds(name_or_path: str, changes: Mapping[str, Any] = NONE) -> Admitted:
    """Read and screen a scenario as `load_admitted` does, and find its odds where its robot declares something.

    Args:
        name_or_path: of the scenario.
        changes: values of keys, by their names with dots, that take the place of the file's.

    Raises:
        InputError: as `load_admitted`.
    """
    scenario, odds = _admitted(name_or_path, NONE, changes)
    # a law that is not compiled takes a minute for all robots
    if odds is None and _has_odds(scenario) and scenario.scheme().compiles:
        odds = _stated(scenario)
    return Admitted(scenario, odds)


def _admitted(name_or_path: str, parameters: Mapping[str, Any], changes: Mapping[str, Any] = NONE) -> Admitted:
    scenario = load_scenario(name_or_path, parameters, changes)
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
    if scenario.trajectory and not _only_loads(verdict):
        scenario.refuse_infeasible(verdict)
    trials = _trials(scenario, plan) if _only_loads(verdict) else None
    if trials is not None and trials.odds.share >= scenario.risk.success:
        return _stated(scenario)
    # here, because most motions are accepted
    from fivebar_bringup.runs.refusal_advice import advice_for

    help_ = advice_for(scenario, plan, verdict, _only_loads(verdict))
    within = f"; within the limits {help_}" if help_ else ""
    unlikely = "" if trials is None else f"; {_unlikely(scenario, trials)}"
    raise PlanRefused(
        f"{'; '.join(verdict.reasons)}{within}{unlikely} (with force: true the scenario runs all the same)"
    )


def _only_loads(verdict: Feasibility) -> bool:
    return [figure.name for figure in verdict.figures if not figure.kept] == [LOADS]


def _unlikely(scenario: Scenario, trials: Trials) -> str:
    """Return by how much the odds of a refused motion are too low, and how the robots fail."""
    # here, because the compiled engine takes long to load, and it is loaded by now
    from fivebar_bringup.odds.odds import failures_in_words

    causes = failures_in_words(trials.failed.values(), scenario.error_tolerance)
    return f"{trials.odds}, expected are at least {scenario.risk.success:.0%}; failed: {causes}"


def _trials(scenario: Scenario, plan: Plan) -> Trials | None:
    """Return the trials of a motion whose loads the screen does not accept; None where robots cannot be drawn."""
    # where the screen finds the loads, it has not predicted the run
    if not (_has_odds(scenario) and screened(scenario, plan, judge_loads=False).feasible):
        return None
    # here, because the compiled engine takes long to load
    from fivebar_bringup.odds.trials import deciding_trials

    with stage("trying drawn robots"):
        return deciding_trials(scenario)


def _has_odds(scenario: Scenario) -> bool:
    if not scenario.declares_errors:
        return False
    # here, because few scenarios declare any
    from fivebar_bringup.odds.robot_errors import has_odds

    return has_odds(scenario)


def _stated(scenario: Scenario) -> Odds:
    # here, because the compiled engine takes long to load
    from fivebar_bringup.odds.trials import declared_odds

    with stage("trying drawn robots"):
        return declared_odds(scenario)
