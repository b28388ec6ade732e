# SPDX-License-Identifier: Apache-2.0
"""The score of a controller: how many crossings succeeded, by the rules and with an interval."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fivebar_bringup.odds.odds import FINAL_LIMIT, PEAK_LIMIT, Interval, clopper_pearson
from fivebar_description.known_drives import USUAL_TORQUE_LIMIT
from fivebar_description.strict_yaml import InputError
from fivebar_studies.benchmark.crossings import CROSSINGS, BenchmarkCrossing
from fivebar_studies.engine.table import RowTable


class SuccessLimits(NamedTuple):
    """The limits of a success.

    Attributes:
        peak, final: distance of the actual platform from the reference (m), always and at the end.
        torque: of either drive (Nm).
    """

    peak: float = PEAK_LIMIT
    final: float = FINAL_LIMIT
    torque: float = USUAL_TORQUE_LIMIT

    @property
    def rules(self) -> str:
        """The rules of success, in words."""
        return (
            "A crossing is a success if the robot is never stopped, changes its assembly mode as often as the crossing"
            f" does, and its platform is always less than {1e3 * self.peak:.3g} mm from the reference and less than"
            f" {1e3 * self.final:.3g} mm at the end, with torques of at most {self.torque:g} Nm. The reference is the"
            " straight segment by the fifth-order polynomial. The errors are those of the actual platform at the same"
            " instant, not of the measured one. A crossing without a line is a failure."
        )


DEXTAR_LIMITS = SuccessLimits()


class Result(NamedTuple):
    """A line of results: the run of a crossing.

    Attributes:
        crossing: number.
        rig: on whose robot.
        controller: by what.
        fault: why it was stopped, "" for nothing.
        mode_changes: of the assembly mode.
        error_peak, error_final: distance of the actual platform from the reference (m), the largest and that at the
            end.
        torque: largest that either drive applied (Nm).
    """

    crossing: int
    rig: str
    controller: str
    fault: str
    mode_changes: int
    error_peak: float
    error_final: float
    torque: float


def _check(result: Result) -> None:
    if not 0 <= result.crossing < CROSSINGS:
        raise ValueError(f"crossing: {result.crossing}: expected a whole number from 0 to {CROSSINGS - 1}")
    for name in ("rig", "controller"):
        if not getattr(result, name).strip():
            raise ValueError(f"{name}: {getattr(result, name)!r}: expected a name")
    for name in ("mode_changes", "error_peak", "error_final", "torque"):
        # NaN is allowed: what is not known
        if getattr(result, name) < 0:
            raise ValueError(f"{name}: {getattr(result, name)}: expected a number, at least 0")


RESULTS = RowTable(Result, _check)
"""The table of a file of results."""


class Score(NamedTuple):
    """A controller's score on a rig.

    Attributes:
        rig, controller: whose.
        successes: how many, of `crossings`.
        crossings: of the benchmark that were to be run.
        interval: of the share of successes, Clopper and Pearson's for 95 %.
        error_median, error_95: of the largest errors (m) of the crossings that have a line.
        torque_median: of the largest torques (Nm).
        stopped: how many had a fault.
    """

    rig: str
    controller: str
    successes: int
    crossings: int
    interval: Interval
    error_median: float
    error_95: float
    torque_median: float
    stopped: int


def success(result: Result, crossing: BenchmarkCrossing, limits: SuccessLimits = DEXTAR_LIMITS) -> bool:
    """Return whether a result meets the rules of limits."""
    return (
        not result.fault
        and result.mode_changes == crossing.mode_changes
        and result.error_peak < limits.peak
        and result.error_final < limits.final
        and result.torque <= limits.torque + 1e-9
    )


def scores(
    results: Sequence[Result], crossings: Sequence[BenchmarkCrossing], limits: SuccessLimits = DEXTAR_LIMITS
) -> list[Score]:
    """Return the score of every controller and rig in the results, on these crossings."""
    groups: dict[tuple[str, str], dict[int, Result]] = {}
    for result in results:
        if result.crossing < len(crossings):
            groups.setdefault((result.rig, result.controller), {})[result.crossing] = result
    return [
        _score(rig, controller, list(by_crossing.values()), crossings, limits)
        for (rig, controller), by_crossing in sorted(groups.items(), key=lambda group: group[0])
    ]


def _score(
    rig: str, controller: str, results: Sequence[Result], crossings: Sequence[BenchmarkCrossing], limits: SuccessLimits
) -> Score:
    good = sum(success(result, crossings[result.crossing], limits) for result in results)
    # an error that is not known is the largest
    errors = [math.inf if math.isnan(result.error_peak) else result.error_peak for result in results]
    torques = [result.torque for result in results]
    return Score(
        rig,
        controller,
        good,
        len(crossings),
        clopper_pearson(good, len(crossings)),
        float(np.percentile(errors, 50, method="inverted_cdf")),
        float(np.percentile(errors, 95, method="inverted_cdf")),
        float(np.percentile(torques, 50, method="inverted_cdf")),
        sum(bool(result.fault) for result in results),
    )


def read_results(text: str, source: str) -> list[Result]:
    """Return the results of a file.

    Raises:
        InputError: a line is not one of results, or one is given twice.
    """
    if text.partition("\n")[0].strip() != RESULTS.head.strip():
        raise InputError(f"{source}: line 1: expected {RESULTS.head.strip()}")
    try:
        results = RESULTS.read(text.partition("\n")[2])
    except ValueError as error:
        raise InputError(f"{source}: {error}") from error
    first_results: dict[tuple[int, str, str], Result] = {}
    for number, result in enumerate(results, start=2):
        if result[:3] in first_results:
            raise InputError(
                f"{source}: line {number}: crossing: {result.crossing}: is given twice for {result.rig!r} and"
                f" {result.controller!r}: expected once"
            )
        first_results[result[:3]] = result
    return results
