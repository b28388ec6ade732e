"""The duration and the time law of a case: as drawn, or as loads and odds ask for."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from fivebar_bringup.odds.choice import likeliest
from fivebar_bringup.odds.drawn_robots import has_odds
from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.robot_errors import UNIFORM
from fivebar_bringup.odds.trials import ROBOTS, odds_of
from fivebar_bringup.studies.rigs.named import find_rig
from fivebar_bringup.studies.sweep.drawing import PLANNED_FOR, RATE_HZ, VARIED, Draw, plan_of
from fivebar_bringup.studies.sweep.screening import limits_for, planned, screened
from fivebar_control.planning.course import STRAIGHT_LAWS
from fivebar_control.planning.figures import Feasibility, nearest
from fivebar_control.planning.pacing import Task, feasible_in, longest_bearing, pace_of
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
    other than the case's own, other durations and time laws are tried on them.

    Raises:
        InputError: the planner refuses the motion.
    """
    first = timed_for_loads(case)
    planned(first)
    if case.rig == VARIED or not has_odds(first.scenario(PLANNED_FOR)):
        return TimedCase(first)
    # what is declared of a robot are bounds, however its errors are distributed
    errors, seed = find_rig(case.rig).errors._replace(distribution=UNIFORM), odds_seed(case)
    by_loads = TimedCase(first, Odds())
    if screened(first, PLANNED_FOR, judge_loads=False).feasible:
        by_loads = TimedCase(first, odds_of(first.scenario(PLANNED_FOR), errors, seed, range(ROBOTS)))
        if by_loads.likely:
            return by_loads
    choice = likeliest(list(_others(case)), lambda one: one.scenario(PLANNED_FOR), errors, seed)
    return by_loads if choice is None else TimedCase(*choice)


def odds_seed(case: Draw) -> int:
    """Return the seed of the robots on which a case is tried."""
    return int(np.random.default_rng((case.seed, case.number, ODDS)).integers(2**62))


def _others(case: Draw) -> Iterator[Draw]:
    """Yield a case in other durations and by each time law, as far as the screen accepts it apart from its loads."""
    for factor in DURATIONS:
        duration = max(1.0, round(factor * case.duration * RATE_HZ)) / RATE_HZ
        for time_law in STRAIGHT_LAWS:
            one = case._replace(duration=duration, drawn_duration=case.duration, time_law=time_law)
            try:
                planned(one)
            except InputError:
                continue
            if screened(one, PLANNED_FOR, judge_loads=False).feasible:
                yield one


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
