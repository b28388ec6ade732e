# SPDX-License-Identifier: Apache-2.0
"""Tries a motion on drawn robots, on the compiled engine."""

from __future__ import annotations

import math
import os
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from concurrent.futures import ThreadPoolExecutor
from itertools import islice
from multiprocessing import parent_process
from typing import NamedTuple

from fivebar_bringup.odds.odds import Odds, shortcomings
from fivebar_bringup.odds.robot_errors import UNIFORM, RobotErrors, declared_errors, with_drawn_robot
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.loop.sampled_plan import sampled
from fivebar_control.trajectory.path_distance import judged_distance

ROBOTS = 24
"""Robots on which a motion is tried for the odds that are stated."""

DECIDING_ROBOTS = range(ROBOTS)
"""Robots by which a motion is accepted, or others are tried."""

OTHER_ROBOTS = range(ROBOTS, 2 * ROBOTS)
"""Robots that have no part in a choice by the first ones."""

LAST_ROBOTS = range(2 * ROBOTS, 3 * ROBOTS)
"""Robots that have no part in a choice by all others."""

STATED_ROBOTS = range(3 * ROBOTS, 4 * ROBOTS)
"""Robots that have no part in accepting a motion, so that the odds that are stated of an accepted one are not those by
which it was accepted: these are too good on average, as motions that happened to do worse were not accepted."""

FRESH_ROBOTS = STATED_ROBOTS.stop
"""Number of the first robot that has no part in a motion's odds."""

SOFTNESS = 0.15
"""How far beyond the tolerance, as a share of it, a run still says something for its motion."""

SEED = 20_011
"""Seed of the drawn robots: all motions are tried on the same ones."""


class Trials(NamedTuple):
    """The results of trying a motion on some robots.

    Attributes:
        odds: how many make it.
        promise: the same with a gradual transition from success to failure by the largest error: of two motions that
            equally many robots make, the one that keeps nearer to its reference has more. A run with a fault has none.
        failed: the robots that do not make it, by their numbers: how each falls short in the first place.
    """

    odds: Odds = Odds()
    promise: float = 0.0
    failed: Mapping[int, str] = {}

    def __add__(self, other: object) -> Trials:
        """Return the trials on the robots of both."""
        if not isinstance(other, Trials):
            return NotImplemented
        return Trials(self.odds + other.odds, self.promise + other.promise, {**self.failed, **other.failed})


def trials_of(
    scenario: Scenario,
    errors: RobotErrors,
    seed: int,
    robots: Iterable[int],
    until: float = math.inf,
    failures: float = math.inf,
) -> Trials:
    """Try a scenario's motion on drawn robots.

    Args:
        scenario: with the motion, the controller and what all its robots have in common.
        errors: within which they are drawn.
        seed: of the draws.
        robots: their numbers; with equal seeds and numbers different motions are tried on the same robots.
        until: when no further robot is begun (s on the steady clock).
        failures: with more of them no further robot is tried, since the motion is not likely enough whatever follows.

    Raises:
        PlanRefused: the motion cannot be made.
    """
    tried, promise = 0, 0.0
    failed: dict[int, str] = {}
    crossings = len(scenario.plan().crossings)
    for run in tries_of(scenario, errors, seed, robots, until):
        tried += 1
        if run.missed:
            failed[run.robot] = run.missed[0]
        if run.outcome.is_as_planned(crossings):
            distance = judged_distance(scenario.judge, run.outcome.error_peak, run.outcome.path_error)
            beyond = distance / scenario.error_tolerance - 1.0
            # the exponent is bounded, as the exponential function overflows
            promise += 1.0 / (1.0 + math.exp(min(beyond / SOFTNESS, 100.0)))
        if len(failed) > failures:
            break
    return Trials(Odds(tried - len(failed), tried), promise, failed)


class Try(NamedTuple):
    """A run of a motion on a drawn robot: the robot's number, what came of it, and how it falls short of a success."""

    robot: int
    outcome: RunMetrics
    missed: list[str]


def tries_of(
    scenario: Scenario, errors: RobotErrors, seed: int, robots: Iterable[int], until: float = math.inf
) -> Iterator[Try]:
    """Yield the runs of a scenario's motion on drawn robots, in their order; arguments as for `trials_of`.

    Some run side by side, in threads.

    Raises:
        PlanRefused: the motion cannot be made.
    """
    plan = scenario.plan()
    samples = sampled(scenario.five_bar(), plan, scenario.rate_hz, scenario.lead_samples)
    planned = plan.path.samples(scenario.rate_hz) + 1
    times = [passage.time for passage in plan.crossings] or [0.5 * plan.path.duration]

    def tried(number: int) -> Try | None:
        if time.monotonic() >= until:
            return None
        # a push meets one of the crossings
        drawn = with_drawn_robot(scenario, errors, seed, number, times[number % len(times)])
        outcome = crossing(case_of(drawn, stop_at_fault=True), samples)
        missed = shortcomings(outcome, planned, len(plan.crossings), scenario.error_tolerance, scenario.judge)
        return Try(number, outcome, missed)

    # as many side by side as there are processors, one in a worker among others
    alone = parent_process() is not None or not scenario.scheme().compiles
    for run in _side_by_side(tried, robots, 1 if alone else len(os.sched_getaffinity(0))):
        if run is None:
            return
        yield run


def _side_by_side(run: Callable[[int], Try | None], robots: Iterable[int], threads: int) -> Iterator[Try | None]:
    """Yield what comes of each robot, in order; the first is run alone, since it loads machine code."""
    left = iter(robots)
    if threads == 1:
        yield from map(run, left)
        return
    yield from map(run, islice(left, 1))
    with ThreadPoolExecutor(threads) as pool:
        while group := list(islice(left, threads)):
            yield from pool.map(run, group)


def declared_odds(scenario: Scenario, robots: int = ROBOTS, distribution: str = UNIFORM) -> Odds:
    """Return the odds of a scenario's motion on so many robots, whose errors are distributed in some way.

    They are the first ones of those by which no motion is accepted: see `STATED_ROBOTS`.

    Raises:
        PlanRefused: the motion cannot be made.
    """
    errors = declared_errors(scenario)._replace(distribution=distribution)
    return trials_of(scenario, errors, SEED, stated(robots)).odds


def deciding_trials(scenario: Scenario) -> Trials:
    """Return the trials by which a scenario's motion is accepted; raises as `declared_odds`."""
    return trials_of(scenario, declared_errors(scenario), SEED, DECIDING_ROBOTS)


def stated(robots: int = ROBOTS) -> range:
    """Return the numbers of so many robots on which odds are stated."""
    return range(STATED_ROBOTS.start, STATED_ROBOTS.start + robots)


def failures_allowed(required: float, robots: int = ROBOTS) -> float:
    """Return how many of some robots may fail for a motion that a share of them has to make."""
    return (1.0 - required) * robots
