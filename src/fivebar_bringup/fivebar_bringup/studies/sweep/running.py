"""Plans, screens and runs one case with every controller."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from functools import lru_cache

from fivebar_bringup.odds.success import PEAK_LIMIT, shortcomings
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import Case, Sampled, case_of, sampled
from fivebar_bringup.simulation.outcome import FAULT_NAMES, Outcome
from fivebar_bringup.simulation.predicted import predicted_on_engine
from fivebar_bringup.simulation.uncompiled import crossing
from fivebar_bringup.studies.sweep.drawing import PLANNED_FOR, RATE_HZ, VARIED, Draw, draw, plan_of
from fivebar_bringup.studies.sweep.rows import FEASIBLE, REFUSED, SCREENED_OUT, SweepRow
from fivebar_control.estimation.homing import check_declared
from fivebar_control.laws import registry
from fivebar_control.planning.course import STRAIGHT_LAWS
from fivebar_control.planning.feasibility import only_torque, screen, with_prediction, with_reserve, with_sensing
from fivebar_control.planning.figures import DWELL, REST, TORQUE, Feasibility, Figure, nearest
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.pacing import Task, longest_bearing, pace_of, retimed
from fivebar_control.planning.timing import SLOWER, UNHURRIED, first_feasible
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.scenario.motion_limits import chosen_limits, given_limits
from fivebar_control.trajectory.planner import Plan
from fivebar_description.loads import NO_LOADS
from fivebar_description.strict_yaml import InputError

SWEPT = tuple(name for name, controller in registry.CONTROLLERS.items() if controller.compiles)
"""The controllers of a sweep, unless others are asked for: those that the engine takes."""


def counted(controllers: Sequence[str]) -> str:
    """Return the one of a sweep's controllers whose feasible crossings count and whose failures are explained."""
    return PLANNED_FOR if PLANNED_FOR in controllers else controllers[0]


def run_case(
    seed: int, number: int, rig: str = VARIED, controllers: Sequence[str] = SWEPT, robot: str = ""
) -> list[SweepRow]:
    """Return the rows of a case: one per controller, or a single one where the planner refuses the motion."""
    case = draw(seed, number, rig, robot)
    try:
        case = timed_for_loads(case)
        plan = planned(case)
    except InputError as refusal:
        return [SweepRow(number, "", REFUSED, str(refusal), None, "", *case[1:])]
    return [_row(case, controller, plan) for controller in controllers]


def timed_for_loads(case: Draw) -> Draw:
    """Return a case as the planner times it for `PLANNED_FOR`: otherwise than drawn where the rig's loads ask for it.

    The drawn duration is what a user asks for; the planner keeps it where the loads displace the platform by no more
    than it aims at. Otherwise it takes the longest duration that does, or the shortest that keeps the other limits, and
    where that is not feasible somewhat longer ones, as for a requested motion. In each case a duration 1.4 times as
    long is taken instead, if the platform is expected no farther from its reference. The polynomial gives way to the
    time law of least torque where only that is feasible, or keeps nearer to the reference.

    Raises:
        InputError: the planner refuses the motion.
    """
    scenario = case.scenario(PLANNED_FOR)
    plan, limits = plan_of(case), limits_for(case, scenario)
    if not limits.loads.declared:
        return case
    task = Task(scenario.five_bar(), scenario.working_mode, RATE_HZ, scenario.tuned(), limits)
    found = first_feasible(
        _durations(task, plan),
        lambda duration: _nearest_by_law(case, duration),
        lambda duration: _nearest_by_law(case, UNHURRIED * duration),
        lambda judged: judged[1],
    )
    return case if isinstance(found, str) else found[0]


def _nearest_by_law(case: Draw, duration: float) -> tuple[Draw, Feasibility] | str:
    """Return a case in a duration (s) by the time law that keeps it nearest to its reference, if one is feasible."""
    timed = case if duration == case.duration else case._replace(duration=duration, drawn_duration=case.duration)
    found = [(one, verdict) for one, verdict in _judged_by_law(timed) if verdict.feasible]
    return nearest(found, lambda judged: judged[1]) if found else "not feasible by any time law"


def _durations(task: Task, drawn: Plan) -> list[float]:
    """Return the durations (s) to try under loads: from the shortest on, at last the drawn one."""
    limits, longest = task.limits, drawn.path.duration
    calm = longest_bearing(task, drawn, limits.risk.load_aim, limits.loads).duration
    if calm == longest:
        return [longest]
    unloaded = task._replace(limits=limits._replace(loads=NO_LOADS))
    wanted = calm
    if not unloaded.judge(retimed(drawn, calm / longest)).feasible:
        wanted = max(calm, pace_of(unloaded, drawn).fastest)
    return [*(factor * wanted for factor in SLOWER if factor * wanted < longest), longest]


def _judged_by_law(case: Draw) -> Iterator[tuple[Draw, Feasibility]]:
    """Yield a case by each time law that the planner does not refuse, with the screen's verdict."""
    for time_law in STRAIGHT_LAWS:
        one = case._replace(time_law=time_law)
        try:
            planned(one)
        except InputError:
            continue
        yield one, screened(one, PLANNED_FOR)


def planned(case: Draw) -> Plan:
    """Return the plan of a case, the same for all controllers.

    Raises:
        InputError: the planner refuses the motion, or the estimator its start.
    """
    plan = plan_of(case)
    scenario = case.scenario(PLANNED_FOR)
    if scenario.estimated:
        check_declared(scenario.five_bar(), scenario.homing())
    return plan


@lru_cache(maxsize=8)
def screened(case: Draw, controller: str) -> Feasibility:
    """Return the screen's judgement of a controller's run of a planned case; predicted where nothing else is.

    The last ones are remembered: a case is judged when it is timed, and again for its row.
    """
    plan, scenario, samples = plan_of(case), case.scenario(controller), _sampled(case)
    limits = limits_for(case, scenario)
    verdict = screen(scenario.five_bar(), plan, RATE_HZ, scenario.tuned(), limits)
    if only_torque(verdict, scenario.tuned()):
        weaker = scenario.plant._replace(torque_limit=limits.torque_share * limits.torque)
        spare = predicted_on_engine(scenario.model_copy(update={"plant": weaker}), samples)
        verdict = with_reserve(verdict, spare, limits)
    if not verdict.feasible:
        return verdict
    predicted = predicted_on_engine(scenario, samples)
    return with_sensing(
        with_prediction(verdict, predicted, plan, limits),
        predicted,
        scenario.five_bar(),
        plan,
        RATE_HZ,
        limits,
        scenario.sensing(),
    )


def limits_for(case: Draw, scenario: Scenario) -> MotionLimits:
    """Return the limits of the screen for a case: with exact sensors those of a motion that is chosen, by a draw."""
    if case.encoder_counts is None:
        return chosen_limits(scenario, torque=case.torque_limit)
    return given_limits(scenario, plan_of(case), case.torque_limit)


def made(scenario: Scenario, plan: Plan, size: float = 1.0) -> tuple[Outcome, list[str]]:
    """Run a scenario with its plan; return the outcome and how it falls short of a success on a robot of a size."""
    samples = sampled(scenario.five_bar(), plan, scenario.rate_hz, scenario.lead_samples)
    return _judged(case_of(scenario), plan, samples, size)


def _judged(case: Case, plan: Plan, samples: Sampled, size: float) -> tuple[Outcome, list[str]]:
    outcome = crossing(case, samples)
    return outcome, shortcomings(outcome, plan.path.samples(case.rate_hz) + 1, len(plan.crossings), size * PEAK_LIMIT)


@lru_cache(maxsize=4)
def _sampled(case: Draw) -> Sampled:
    scenario = case.scenario(PLANNED_FOR)
    return sampled(scenario.five_bar(), plan_of(case), RATE_HZ, scenario.lead_samples)


def _row(case: Draw, controller: str, plan: Plan) -> SweepRow:
    verdict = screened(case, controller)
    outcome, missed = _judged(case_of(case.scenario(controller)), plan, _sampled(case), case.size)
    nearest = max(verdict.figures, key=use_of)
    first = plan.crossings[0]
    faulty = outcome.fault != NO_FAULT
    return SweepRow(
        case.number,
        controller,
        FEASIBLE if verdict.feasible else SCREENED_OUT,
        "; ".join(verdict.reasons),
        not missed,
        "; ".join(missed),
        *case[1:],
        crossings=len(plan.crossings),
        authority=min(crossing.authority for crossing in plan.crossings),
        crossing_x=first.x,
        crossing_y=first.y,
        reference_torque=_value(verdict, TORQUE),
        dwell=_value(verdict, DWELL),
        rest_kappa=_value(verdict, REST),
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


def _value(verdict: Feasibility, name: str) -> float | None:
    figure = verdict.figure(name)
    return None if figure is None else figure.value
