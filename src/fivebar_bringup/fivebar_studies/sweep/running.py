# SPDX-License-Identifier: Apache-2.0
"""Plans, screens and runs one case with every controller."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import partial

from fivebar_bringup.odds.odds import PEAK_LIMIT, Odds, shortcomings
from fivebar_bringup.odds.planned_motion import PlannedMotion
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import Case, case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.laws import registry
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.loop.sampled_plan import Sampled, sampled
from fivebar_control.planning.figures import DWELL, REST, TORQUE, Feasibility, Figure
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.trajectory.planner import Plan
from fivebar_description.strict_yaml import InputError
from fivebar_studies.engine.turns import in_turns
from fivebar_studies.sweep.drawing import PLANNED_FOR, RATE_HZ, VARIED, Draw, draw
from fivebar_studies.sweep.planning import planned, sampled_case, screened, timed
from fivebar_studies.sweep.rows import FEASIBLE, REFUSED, SCREENED_OUT, SUCCESS_PROBABILITY, SweepRow

SWEPT = tuple(name for name in registry.timed_controllers() if registry.CONTROLLERS[name].compiles)
"""The controllers of a sweep, unless others are asked for: those that numba compiles."""


def counted(controllers: Sequence[str]) -> str:
    """Return the one of a sweep's controllers whose feasible crossings count and whose failures are explained."""
    return PLANNED_FOR if PLANNED_FOR in controllers else controllers[0]


def run_case(
    seed: int, number: int, rig: str = VARIED, controllers: Sequence[str] = SWEPT, robot: str = ""
) -> list[SweepRow]:
    """Return the rows of a case: one per controller, or a single one where the planner refuses the motion."""
    case = draw(seed, number, rig, robot)
    try:
        timed_case = timed(case)
    except InputError as refusal:
        return [SweepRow(number, "", REFUSED, str(refusal), None, "", *case[1:])]
    return in_turns(partial(_row, timed_case), controllers, number)


def run_and_judge(scenario: Scenario, plan: Plan, size: float = 1.0) -> tuple[RunMetrics, list[str]]:
    """Run a scenario with its plan; return the outcome and how it falls short of a success on a robot of a size."""
    samples = sampled(scenario.five_bar(), plan, scenario.rate_hz, scenario.lead_samples)
    return _judged(case_of(scenario), plan, samples, size, scenario.judge)


def _judged(case: Case, plan: Plan, samples: Sampled, size: float, judge: str) -> tuple[RunMetrics, list[str]]:
    outcome, planned_samples = crossing(case, samples), plan.path.samples(case.numbers.rate_hz) + 1
    return outcome, shortcomings(outcome, planned_samples, len(plan.crossings), size * PEAK_LIMIT, judge)


def verdict_on(timed_case: PlannedMotion[Draw], controller: str) -> tuple[Feasibility, list[str]]:
    """Return the screen's judgement of a controller's run, and why screen or odds refuse it; nothing where neither."""
    odds = _odds_for(timed_case, controller)
    verdict = screened(timed_case.motion, controller, judge_loads=odds is None)
    reasons = [*verdict.reasons]
    if verdict.feasible and odds is not None and not timed_case.likely:
        reasons.append(f"{SUCCESS_PROBABILITY} is {odds.share:.3g}, expected at least {timed_case.required:g}")
    return verdict, reasons


def _odds_for(timed_case: PlannedMotion[Draw], controller: str) -> Odds | None:
    """Return the odds of a case for a controller: those of the law for which the motion is planned."""
    return timed_case.odds if controller == PLANNED_FOR else None


def _row(timed_case: PlannedMotion[Draw], controller: str) -> SweepRow:
    case, odds = timed_case.motion, _odds_for(timed_case, controller)
    plan = planned(case)
    verdict, reasons = verdict_on(timed_case, controller)
    scenario = case.scenario(controller)
    outcome, missed = _judged(case_of(scenario), plan, sampled_case(case), case.size, scenario.judge)
    nearest = max(verdict.figures, key=use_of)
    first = plan.crossings[0]
    faulty = outcome.fault != NO_FAULT
    return SweepRow(
        case.number,
        controller,
        SCREENED_OUT if reasons else FEASIBLE,
        "; ".join(reasons),
        not missed,
        "; ".join(missed),
        *case[1:],
        crossings=len(plan.crossings),
        authority=min(crossing.authority for crossing in plan.crossings),
        crossing_x=first.x,
        crossing_y=first.y,
        reference_torque=verdict.value(TORQUE),
        dwell=verdict.value(DWELL),
        rest_kappa=verdict.value(REST),
        limit=nearest.name,
        limit_use=use_of(nearest),
        fault=FAULT_NAMES[outcome.fault],
        fault_time=outcome.fault_sample / RATE_HZ if faulty else None,
        mode_changes=outcome.mode_changes,
        error_peak=outcome.error_peak,
        error_final=outcome.error_final,
        requested=max(outcome.requested1, outcome.requested2),
        applied=max(outcome.applied1, outcome.applied2),
        saturated=outcome.saturated,
        samples=outcome.samples,
        left_time=outcome.left_sample / RATE_HZ if outcome.left_sample >= 0 else None,
        estimate_error=outcome.estimate_error,
        type1_distance=outcome.type1_distance,
        work=outcome.work,
        distal_links=" and ".join(sorted({crossing.distal_links for crossing in plan.crossings}, reverse=True)),
        likely_robots=odds.successes if odds is not None and odds.robots else None,
        drawn_robots=odds.robots if odds is not None and odds.robots else None,
        path_error=outcome.path_error,
    )


def use_of(figure: Figure) -> float:
    """Return how much of its limit a figure uses: more than 1 is beyond; infinite for an undefined figure."""
    if math.isnan(figure.value):
        return math.inf
    if figure.at_most and figure.limit == 0.0:
        return 0.0 if figure.kept else math.inf
    if figure.at_most:
        return figure.value / figure.limit
    return figure.limit / figure.value if figure.value > 0.0 else math.inf
