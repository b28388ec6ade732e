# SPDX-License-Identifier: Apache-2.0
"""Limits of the estimator's watch that follow from what is declared of a robot: what sound robots reach, and beyond.

Robots are drawn within the declared tolerances and loads, and make the motion without any limit of the watch. Their
largest innovations have a tail to which a generalised Pareto distribution is fitted by moments, taken as exponential
where it seems lighter (peaks over a threshold). The limit is where it leaves one false alarm in `ALARMS` crossings, at
the upper end of the interval that drawing the runs again gives.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from fivebar_bringup.odds.robot_errors import RobotErrors
from fivebar_bringup.odds.trials import tries_of
from fivebar_bringup.scenario import Scenario
from fivebar_control.estimation.constants import NO_LIMITS, WatchLimits

ALARMS = 10_000
"""Crossings in which one false alarm is expected at most, over all limits together."""

TAIL = 0.1
"""Share of the runs, the highest ones, to which the tail is fitted."""

FEWEST = 20
"""Runs in the tail, at least."""

REDRAWS, UPPER, SEED = 200, 0.975, 39
"""How often the runs are drawn again for the interval, its upper end, and the seed of the draws."""


class FittedLimit(NamedTuple):
    """A limit with what it was fitted to.

    Attributes:
        limit: the upper end of the interval of the quantile.
        quantile: that leaves as many false alarms as are allowed, by the fit.
        largest: of all runs.
        runs: to which it was fitted.
    """

    limit: float
    quantile: float
    largest: float
    runs: int


def fitted_limit(maxima: Sequence[float], alarms: float = len(WatchLimits._fields) * ALARMS) -> FittedLimit:
    """Return the limit that a run's maximum exceeds once in so many runs, of the maxima of at least `FEWEST` runs.

    Raises:
        ValueError: there are fewer runs.
    """
    runs = len(maxima)
    if runs < FEWEST:
        raise ValueError(f"{runs} runs: expected at least {FEWEST}")
    values = np.array(maxima, dtype=np.float64)
    redrawn = [tail.quantile(alarms) for tail in _redrawn([*values.reshape(-1, 1)])]
    largest, quantile = float(values.max()), tail_of(values).quantile(alarms)
    return FittedLimit(max(float(np.quantile(redrawn, UPPER)), largest), quantile, largest, runs)


class Tail(NamedTuple):
    """The tail of a distribution.

    Attributes:
        threshold: where it begins.
        share: of the values that are beyond.
        scale, shape: of the generalised Pareto distribution there, exponential where the shape is 0.
    """

    threshold: float
    share: float
    scale: float
    shape: float

    def quantile(self, one_in: float) -> float:
        """Return the value that one in so many exceeds."""
        wanted = math.log(one_in * self.share)
        if self.shape == 0.0:
            return self.threshold + self.scale * wanted
        return self.threshold + self.scale / self.shape * (math.exp(self.shape * wanted) - 1.0)

    def beyond(self, limit: float) -> float:
        """Return the share of values beyond a limit, which is not below the threshold."""
        if self.scale == 0.0:
            return 0.0
        excess = (limit - self.threshold) / self.scale
        if self.shape == 0.0:
            return self.share * math.exp(-excess)
        return self.share * math.exp(-math.log(1.0 + self.shape * excess) / self.shape)


def tail_of(values: NDArray[np.float64]) -> Tail:
    """Return the tail of at least `FEWEST` values, fitted by moments."""
    runs = len(values)
    ordered = np.sort(values)
    number = min(runs - 1, max(FEWEST, round(TAIL * runs)))
    threshold = float(ordered[-number - 1])
    excess = ordered[-number:] - threshold
    mean, variance = float(excess.mean()), float(excess.var())
    if variance <= mean * mean or mean == 0.0:
        return Tail(threshold, number / runs, mean, 0.0)
    ratio = mean * mean / variance
    return Tail(threshold, number / runs, 0.5 * mean * (1.0 + ratio), 0.5 * (1.0 - ratio))


def _redrawn(groups: Sequence[NDArray[np.float64]]) -> Iterator[Tail]:
    """Yield the tails of the same runs drawn again, those that are alike together."""
    random = np.random.default_rng(SEED)
    for _ in range(REDRAWS):
        yield tail_of(np.concatenate([groups[index] for index in random.choice(len(groups), len(groups))]))


class AlarmRate(NamedTuple):
    """The share of sound runs that exceed a limit, by the fitted tail, and the upper end of its interval."""

    rate: float
    upper: float


def alarm_rate(uses: Iterable[Sequence[float]]) -> AlarmRate | None:
    """Return how often sound runs exceed their limit, of the share of it that each reaches; None of too few runs.

    Args:
        uses: shares of the runs of each crossing, which are alike: the interval is that of drawing crossings.
    """
    groups = [np.array(shares, dtype=np.float64) for shares in uses]
    if sum(map(len, groups)) < FEWEST:
        return None
    drawn = [redrawn.beyond(max(1.0, redrawn.threshold)) for redrawn in _redrawn(groups)]
    tail = tail_of(np.concatenate(groups))
    return AlarmRate(tail.beyond(max(1.0, tail.threshold)), float(np.quantile(drawn, UPPER)))


def sound_maxima(scenario: Scenario, errors: RobotErrors, seed: int, robots: Iterable[int]) -> list[WatchLimits]:
    """Return the largest of what the watch limits, on each drawn robot that makes the motion without another fault.

    Args:
        scenario: with the motion, and an estimator.
        errors: within which the robots are drawn.
        seed: of the draws.
        robots: their numbers.

    Raises:
        PlanRefused: the motion cannot be made.
    """
    crossings = len(scenario.plan().crossings)
    unlimited = scenario.model_copy(update={"ekf": scenario.ekf._replace(**NO_LIMITS._asdict(), error_limit=0.0)})
    outcomes = (run.outcome for run in tries_of(unlimited, errors, seed, robots))
    return [
        WatchLimits(outcome.misfit, outcome.misfit_offset, outcome.misfit_jump)
        for outcome in outcomes
        if outcome.is_as_planned(crossings) and outcome.left_sample < 0
    ]


def fitted_limits(maxima: Sequence[WatchLimits]) -> dict[str, FittedLimit]:
    """Return the limits by their names; raises as `fitted_limit`."""
    return {
        name: fitted_limit([largest[place] for largest in maxima]) for place, name in enumerate(WatchLimits._fields)
    }


def as_settings(limits: dict[str, FittedLimit]) -> dict[str, float]:
    """Return limits as keys of the section `ekf`, rounded up to two digits."""
    return {name: rounded_up(fitted.limit) for name, fitted in limits.items()}


def rounded_up(value: float) -> float:
    """Return a positive number rounded up to two digits."""
    step = 10.0 ** (math.floor(math.log10(value)) - 1)
    return float(f"{math.ceil(value / step - 1e-9) * step:.2g}")
