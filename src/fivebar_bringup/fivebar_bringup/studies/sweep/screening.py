"""Plans a case of a sweep, and judges by a controller's screen what becomes of it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import lru_cache
from itertools import count

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import Sampled, sampled
from fivebar_bringup.simulation.predicted import predicted_on_engine
from fivebar_bringup.studies.sweep.drawing import PLANNED_FOR, RATE_HZ, Draw, plan_of
from fivebar_control.estimation.homing import check_declared
from fivebar_control.planning.feasibility import only_torque, screen, with_prediction, with_reserve, with_sensing
from fivebar_control.planning.figures import Feasibility
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.scenario.motion_limits import chosen_limits, given_limits
from fivebar_control.trajectory.planner import Plan
from fivebar_description.strict_yaml import InputError


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


def accepted(drawn: Callable[[int], Draw], controller: str = PLANNED_FOR) -> Iterator[Draw]:
    """Yield the cases that planner and screen accept for a controller, without end; `drawn` returns one by its number.

    A case that `drawn` refuses by an `InputError` is left out, too.
    """
    for number in count():
        try:
            case = drawn(number)
            planned(case)
            feasible = screened(case, controller).feasible
        except InputError:
            continue
        if feasible:
            yield case


@lru_cache(maxsize=8)
def screened(case: Draw, controller: str, judge_loads: bool = True) -> Feasibility:
    """Return the screen's judgement of a controller's run of a planned case; predicted where nothing else is.

    The declared loads are judged too, unless the odds decide about them.

    The last ones are remembered: a case is judged when it is timed, and again for its row.
    """
    plan, scenario = plan_of(case), case.scenario(controller)
    limits = limits_for(case, scenario)
    if not judge_loads:
        limits = limits.without_loads()
    verdict = screen(scenario.five_bar(), plan, RATE_HZ, scenario.tuned(), limits)
    if only_torque(verdict, scenario.tuned()):
        weaker = scenario.plant._replace(torque_limit=limits.torque_share * limits.torque)
        spare = predicted_on_engine(scenario.model_copy(update={"plant": weaker}), sampled_case(case))
        verdict = with_reserve(verdict, spare, limits)
    if not verdict.feasible:
        return verdict
    predicted = predicted_on_engine(scenario, sampled_case(case))
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


@lru_cache(maxsize=4)
def sampled_case(case: Draw) -> Sampled:
    """Return the plan of a case at its samples, the same for all controllers."""
    scenario = case.scenario(PLANNED_FOR)
    return sampled(scenario.five_bar(), plan_of(case), RATE_HZ, scenario.lead_samples)
