# SPDX-License-Identifier: Apache-2.0
"""Plans, times and judges a case of a sweep: by a controller's screen, a run predicted on the engine, and its odds."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from functools import lru_cache, partial
from itertools import count
from typing import NamedTuple

import numpy as np

from fivebar_bringup.odds.alternatives import Alternatives, best_of_all, first_or_best
from fivebar_bringup.odds.likely import with_stated_odds
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.planned_motion import PlannedMotion
from fivebar_bringup.odds.robot_errors import UNIFORM, has_odds
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.predicted import predict_on_engine
from fivebar_control.estimation.homing import check_declared
from fivebar_control.loop.sampled_plan import Sampled, sampled
from fivebar_control.planning.alternative_courses import TimedCourse, courses_elsewhere
from fivebar_control.planning.course import STRAIGHT_LAWS
from fivebar_control.planning.feasibility import screen_run
from fivebar_control.planning.figures import Feasibility, first_feasible, nearest
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.pacing import LOAD_AIM, Task, feasible_in, longest_bearing, pace_of
from fivebar_control.planning.timing import SLOWER, UNHURRIED
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_control.scenario.motion_limits import scenario_limits
from fivebar_control.scenario.sensors import homing_of, sensing_if_estimated
from fivebar_control.trajectory.planner import Plan
from fivebar_description.loads import NO_LOADS
from fivebar_description.strict_yaml import InputError
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.sweep.drawing import PLANNED_FOR, RATE_HZ, VARIED, Draw, plan_of

ODDS = 4
"""Random stream of a case besides those of its motion and its robot."""

DURATIONS = tuple(1.4 * 0.8**step for step in range(14))
"""Durations that are tried for better odds, relative to the one drawn."""


def planned(case: Draw) -> Plan:
    """Return the plan of a case, the same for all controllers.

    Raises:
        InputError: the planner refuses the motion, or the estimator its start.
    """
    plan = plan_of(case)
    scenario = case.scenario(PLANNED_FOR)
    if scenario.estimated:
        check_declared(scenario.five_bar(), homing_of(scenario))
    return plan


def accepted(drawn: Callable[[int], Draw], controller: str = PLANNED_FOR) -> Iterator[Draw]:
    """Yield the cases that planner and screen accept for a controller, without end; `drawn` returns one by its number.

    A case that `drawn` refuses by an `InputError` is left out, too.
    """
    for number in count():
        try:
            case = drawn(number)
        except InputError:
            continue
        if verdict_if_accepted(case, controller) is not None:
            yield case


def verdict_if_accepted(case: Draw, controller: str = PLANNED_FOR, judge_loads: bool = True) -> Feasibility | None:
    """Return the screen's judgement of a case; None where planner or screen refuse it for a controller."""
    try:
        planned(case)
        verdict = screened(case, controller, judge_loads)
    except InputError:
        return None
    return verdict if verdict.feasible else None


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
    robot, follower, predict = scenario.five_bar(), tuned_controller(scenario), partial(predict_on_engine, scenario)
    return screen_run(robot, plan, RATE_HZ, follower, limits, sensing_if_estimated(scenario), predict)


def limits_for(case: Draw, scenario: Scenario) -> MotionLimits:
    """Return the limits of the screen for a case: with exact sensors those of a motion that is chosen, by a draw."""
    return scenario_limits(scenario, None if case.encoder_counts is None else plan_of(case), torque=case.torque_limit)


def sampled_case(case: Draw) -> Sampled:
    """Return the plan of a case at its samples, the same for all controllers."""
    scenario = case.scenario(PLANNED_FOR)
    return sampled(scenario.five_bar(), plan_of(case), RATE_HZ, scenario.lead_samples)


def timed(case: Draw) -> PlannedMotion[Draw]:
    """Return a case as the planner times it for `PLANNED_FOR`.

    First it is timed for the declared loads. Where not enough of the robots make it that are drawn as the rig's are,
    other than the case's own, other durations, time laws and places of crossing are tried on them.

    Raises:
        InputError: the planner refuses the motion.
    """
    first = _planned_motion(timed_for_loads(case))
    planned(first.motion)
    scenario = first.scenario
    if case.rig == VARIED or not has_odds(scenario):
        return first
    # what is declared of a robot are bounds, however its errors are distributed
    errors, seed = find_rig(case.rig).errors._replace(distribution=UNIFORM), odds_seed(case)

    def along(course: TimedCourse) -> PlannedMotion[Draw] | None:
        other = case.along(course)
        return None if verdict_if_accepted(other, judge_loads=False) is None else _planned_motion(other)

    def elsewhere() -> Iterable[TimedCourse]:
        limits = limits_for(case, scenario).without_loads()
        task = Task(scenario.five_bar(), scenario.working_mode, RATE_HZ, tuned_controller(scenario), limits)
        start, goal = scenario.waypoints
        return courses_elsewhere(task, start, goal, plan_of(first.motion))

    robot = scenario.five_bar()
    alternatives = Alternatives(along, lambda course: course.by_other_laws(robot), elsewhere, RATE_HZ)
    motions = alternatives.in_durations(first, (duration * case.duration for duration in DURATIONS))
    if screened(first.motion, PLANNED_FOR, judge_loads=False).feasible:
        choice = first_or_best(first, motions, alternatives, errors, seed)
    elif (best := best_of_all([*motions], alternatives, errors, seed, first.required)) is not None:
        choice = best
    else:
        return first._replace(odds=Odds(), likely=False)
    if choice.likely:
        return with_stated_odds(choice.motion, errors, seed)
    return choice.motion._replace(odds=choice.odds, likely=False)


def _planned_motion(case: Draw) -> PlannedMotion[Draw]:
    """Return a planned case with its scenario for `PLANNED_FOR`."""
    return PlannedMotion(case, case.scenario(PLANNED_FOR))


def odds_seed(case: Draw) -> int:
    """Return the seed of the robots on which a case is tried."""
    return int(np.random.default_rng((case.seed, case.number, ODDS)).integers(2**62))


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
    task = Task(scenario.five_bar(), scenario.working_mode, RATE_HZ, tuned_controller(scenario), limits)
    nearest_case = first_feasible(
        _durations(task, plan),
        lambda duration: _nearest_by_law(case, duration),
        lambda duration: _nearest_by_law(case, UNHURRIED * duration),
    )
    return case if isinstance(nearest_case, str) else nearest_case.case


class JudgedCase(NamedTuple):
    """A case that planner and screen accept, with the screen's judgement."""

    case: Draw
    feasibility: Feasibility


def _nearest_by_law(case: Draw, duration: float) -> JudgedCase | str:
    """Return a case in a duration (s) by the time law that keeps it nearest to its reference, if one is feasible."""
    timed = case if duration == case.duration else case._replace(duration=duration, drawn_duration=case.duration)
    cases = [timed._replace(time_law=time_law) for time_law in STRAIGHT_LAWS]
    judged = [JudgedCase(by_law, verdict) for by_law in cases if (verdict := verdict_if_accepted(by_law)) is not None]
    return nearest(judged) if judged else "not feasible by any time law"


def _durations(task: Task, drawn: Plan) -> list[float]:
    """Return the durations (s) to try under loads: from the shortest on, at last the drawn one."""
    limits, longest = task.limits, drawn.path.duration
    calm = longest_bearing(task, drawn, LOAD_AIM, limits.loads).duration
    if calm == longest:
        return [longest]
    unloaded = task._replace(limits=limits._replace(loads=NO_LOADS))
    wanted = calm
    if not feasible_in(unloaded, drawn, calm):
        wanted = max(calm, pace_of(unloaded, drawn).fastest)
    return [*(factor * wanted for factor in SLOWER if factor * wanted < longest), longest]
