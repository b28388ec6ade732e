"""The duration, the time law and the place of crossing of a case: as drawn, or as loads and odds ask for."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import NamedTuple

import numpy as np

from fivebar_bringup.odds.alternatives import Alternatives, Candidate, best_of_all
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.robot_errors import UNIFORM, has_odds
from fivebar_bringup.odds.trials import ROBOTS, trials_of
from fivebar_bringup.studies.rigs.named import find_rig
from fivebar_bringup.studies.sweep.drawing import PLANNED_FOR, RATE_HZ, VARIED, Draw, plan_of
from fivebar_bringup.studies.sweep.screening import limits_for, planned, screened
from fivebar_control.planning.course import STRAIGHT_LAWS
from fivebar_control.planning.figures import Feasibility, nearest
from fivebar_control.planning.pacing import Task, feasible_in, longest_bearing, pace_of
from fivebar_control.planning.places import TimedCourse, courses_elsewhere
from fivebar_control.planning.timing import SLOWER, UNHURRIED, first_feasible
from fivebar_control.trajectory.planner import Plan
from fivebar_description.loads import NO_LOADS
from fivebar_description.strict_yaml import InputError

ODDS = 4
"""Random stream of a case besides those of its motion and its robot."""

DURATIONS = tuple(1.4 * 0.8**step for step in range(14))
"""Durations that are tried for better odds, relative to the one drawn."""


class TimedCase(NamedTuple):
    """A case as its planner times it, with its odds; None where its robots declare nothing to draw from."""

    case: Draw
    odds: Odds | None = None

    @property
    def required(self) -> float:
        """The share of robots that have to make it."""
        return self.case.scenario(PLANNED_FOR).risk.success

    @property
    def likely(self) -> bool:
        """Whether enough of the drawn robots make it; also where none are drawn."""
        return self.odds is None or self.odds.share >= self.required


def timed(case: Draw) -> TimedCase:
    """Return a case as the planner times it for `PLANNED_FOR`.

    First it is timed for the declared loads. Where not enough of the robots make it that are drawn as the rig's are,
    other than the case's own, other durations, time laws and places of crossing are tried on them.

    Raises:
        InputError: the planner refuses the motion.
    """
    first = timed_for_loads(case)
    planned(first)
    if case.rig == VARIED or not has_odds(first.scenario(PLANNED_FOR)):
        return TimedCase(first)
    # what is declared of a robot are bounds, however its errors are distributed
    errors, seed = find_rig(case.rig).errors._replace(distribution=UNIFORM), odds_seed(case)
    scenario = first.scenario(PLANNED_FOR)
    feasible = screened(first, PLANNED_FOR, judge_loads=False).feasible
    by_loads = TimedCase(first, trials_of(scenario, errors, seed, range(ROBOTS)).odds if feasible else Odds())
    if feasible and by_loads.likely:
        return by_loads

    def tried(course: TimedCourse) -> Candidate[Draw] | None:
        return _feasible(case.along(course))

    def elsewhere() -> Iterable[TimedCourse]:
        limits = limits_for(case, scenario).without_loads()
        task = Task(scenario.five_bar(), scenario.working_mode, RATE_HZ, scenario.tuned(), limits)
        start, goal = scenario.waypoints
        return courses_elsewhere(task, start, goal, plan_of(first))

    robot = scenario.five_bar()
    alternatives = Alternatives(tried, lambda course: course.by_other_laws(robot), elsewhere, RATE_HZ)
    durations = (alternatives.in_duration(Candidate(first, scenario), one * case.duration) for one in DURATIONS)
    motions = [one for one in durations if one is not None]
    choice = best_of_all(motions, alternatives, errors, seed, by_loads.required)
    return by_loads if choice is None else TimedCase(choice.motion.motion, choice.odds)


def _feasible(case: Draw) -> Candidate[Draw] | None:
    """Return a case with its scenario, None where planner or screen refuse it, apart from its loads."""
    try:
        planned(case)
    except InputError:
        return None
    accepted = screened(case, PLANNED_FOR, judge_loads=False).feasible
    return Candidate(case, case.scenario(PLANNED_FOR)) if accepted else None


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
    if not feasible_in(unloaded, drawn, calm):
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
