# SPDX-License-Identifier: Apache-2.0
"""Shares, errors and differences of an assessment, with intervals that count motions and not runs."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Sequence
from typing import NamedTuple

import numpy as np

from fivebar_bringup.odds.odds import clopper_pearson
from fivebar_studies.assess.rows import ACCEPTED, RANDOM, UNLIKELY, AssessRow
from fivebar_studies.rigs.declared import DECLARED, REMOVED, SENSORS, TUNINGS, UPGRADES, VARIANTS

RUN = ACCEPTED, UNLIKELY
"""Statuses of motions that were run."""

ERROR_PROBABILITY = 0.05
"""Probability that any interval of a table of changes does not hold its gain."""


class Success(NamedTuple):
    """A share of runs that succeed, and its interval for 95 %."""

    share: float
    runs: int
    low: float
    high: float

    def __str__(self) -> str:
        """Return it for a person."""
        return f"{self.share:.1%} ({100.0 * self.low:.0f} to {self.high:.0%})" if self.runs else "none"


class Expected(NamedTuple):
    """The expected results of a controller in the motions that are accepted: success, and largest errors (m)."""

    controller: str
    success: Success
    median: float
    most: float
    estimate: float


class Change(NamedTuple):
    """The difference that a variant of the robot makes, in all motions that were run.

    Attributes:
        variant: its name.
        success: with it.
        gain: of the success, as a share, against the robot as declared, on the same robots and motions.
        spread: half width of the gain's interval, which holds for all changes of a table at once for 95 %.
        error: median of the largest errors (m).
        ratio: of that median to the one as declared.
    """

    variant: str
    success: Success
    gain: float
    spread: float
    error: float
    ratio: float

    @property
    def words(self) -> str:
        """The change in words."""
        return VARIANTS[self.variant].words

    @property
    def remedy(self) -> str:
        """The way to make the change."""
        return VARIANTS[self.variant].remedy

    @property
    def sure(self) -> bool:
        """Whether the gain is more than chance."""
        return self.gain > self.spread

    @property
    def decided(self) -> bool:
        """Whether the change makes a difference that is more than chance, for better or for worse."""
        return abs(self.gain) > self.spread


def random_runs(
    rows: Iterable[AssessRow], controller: str, variant: str = DECLARED, statuses: Sequence[str] = RUN
) -> list[AssessRow]:
    """Return the runs of random crossings."""
    return [
        row
        for row in rows
        if row.motion == RANDOM
        and row.robot is not None
        and (row.controller, row.variant) == (controller, variant)
        and row.status in statuses
    ]


def status_counts(rows: Iterable[AssessRow]) -> Counter[str]:
    """Return how many random crossings have each status."""
    return Counter({row.case: row.status for row in rows if row.motion == RANDOM}.values())


def by_case(rows: Iterable[AssessRow]) -> dict[int, float]:
    """Return the share of successful runs of each motion."""
    successes: dict[int, list[bool]] = {}
    for row in rows:
        successes.setdefault(row.case, []).append(bool(row.success))
    return {case: sum(succeeded) / len(succeeded) for case, succeeded in successes.items()}


def success_of(rows: Sequence[AssessRow]) -> Success:
    """Return the share of runs that succeed.

    Runs of one motion are alike. The interval is that of as many independent runs as have the same variance: at least
    one for each motion, at most all of them.
    """
    shares = list(by_case(rows).values())
    if not shares:
        return Success(0.0, 0, 0.0, 1.0)
    share, count = sum(shares) / len(shares), len(shares)
    variance = float(np.var(shares, ddof=1)) / count if count > 1 else 0.0
    alike = share * (1.0 - share) / variance if variance > 0.0 else float(count)
    independent = round(min(max(alike, count), len(rows)))
    low, high = clopper_pearson(round(share * independent), independent)
    return Success(share, len(rows), min(low, share), max(high, share))


def peaks(rows: Iterable[AssessRow]) -> list[float]:
    """Return the largest distances from the reference (m)."""
    return [row.error_peak if row.error_peak is not None else math.inf for row in rows]


def expected(rows: Sequence[AssessRow], controllers: Sequence[str]) -> list[Expected]:
    """Return what to expect of each controller in the motions that are accepted."""
    expectations = []
    for controller in controllers:
        runs = random_runs(rows, controller, statuses=(ACCEPTED,))
        if runs:
            estimates = [row.estimate_error or 0.0 for row in runs]
            median, most = np.quantile(peaks(runs), (0.5, 0.95)).tolist()
            expectations.append(Expected(controller, success_of(runs), median, most, float(np.median(estimates))))
    return expectations


def changes(rows: Sequence[AssessRow], controller: str, variants: Iterable[str]) -> list[Change]:
    """Return what each variant changes, as far as it was run; the largest gain first, then the smallest error."""
    base = random_runs(rows, controller)
    before, error = by_case(base), float(np.median(peaks(base))) if base else math.nan
    runs_of = {variant: base if variant == DECLARED else random_runs(rows, controller, variant) for variant in variants}
    with_runs = {variant: runs for variant, runs in runs_of.items() if runs}
    compared = max(1, len(with_runs.keys() - {DECLARED}))
    listed = []
    for variant, runs in with_runs.items():
        after = by_case(runs)
        gains = [after[case] - before[case] for case in before]
        median = float(np.median(peaks(runs)))
        gain = sum(gains) / len(gains)
        listed.append(Change(variant, success_of(runs), gain, half_width(gains, compared), median, median / error))
    return sorted(listed, key=lambda change: (-round(change.gain, 3), change.ratio))


def half_width(gains: Sequence[float], compared: int) -> float:
    """Return the half width of the interval of a mean gain by Student's t, one of so many that hold at once for 95 %.

    The motions are independent, the robots that make one of them are not.
    """
    if len(gains) < 2:
        return 1.0
    # here, because scipy takes long to load
    from scipy.special import stdtrit

    deviations = float(stdtrit(len(gains) - 1, 1.0 - 0.5 * ERROR_PROBABILITY / compared))
    return deviations * float(np.std(gains, ddof=1)) / math.sqrt(len(gains))


def removed_errors(rows: Sequence[AssessRow], controller: str) -> list[Change]:
    """Return what comes of each error that is removed, ranked; only those whose removal is sure to help."""
    return [change for change in changes(rows, controller, REMOVED) if change.sure]


def sensor_changes(rows: Sequence[AssessRow], controller: str) -> list[Change]:
    """Return what comes of each set of sensors that makes a difference, ranked; the declared set is among them."""
    of_sensors = changes(rows, controller, (DECLARED, *SENSORS))
    return [change for change in of_sensors if change.variant == DECLARED or change.decided]


def upgrades(rows: Sequence[AssessRow], controller: str) -> list[Change]:
    """Return the robot as declared, and with each of `UPGRADES` that it does not have."""
    return sorted(changes(rows, controller, (DECLARED, *UPGRADES)), key=lambda change: change.gain)


def tuning_changes(rows: Sequence[AssessRow], controller: str) -> list[Change]:
    """Return what comes of each bandwidth, ranked."""
    return changes(rows, controller, (DECLARED, *TUNINGS))


def best_tuning(rows: Sequence[AssessRow], controller: str) -> str:
    """Return the variant with the bandwidth to recommend: another one than declared only where it is surely better."""
    of_tuning = tuning_changes(rows, controller)
    return of_tuning[0].variant if of_tuning and of_tuning[0].sure else DECLARED


class TypicalResult(NamedTuple):
    """The result of a typical motion on a variant of the robot: its success, or why it is refused; its duration (s)."""

    success: Success | None
    duration: float | None
    reason: str


def typical_results(rows: Sequence[AssessRow], controller: str) -> dict[str, dict[str, TypicalResult]]:
    """Return the results of each typical motion, by its name and by variant in the order in which they were tried."""
    by_motion: dict[str, dict[str, TypicalResult]] = {}
    for name in dict.fromkeys(row.motion for row in rows if row.motion != RANDOM):
        of_motion = [row for row in rows if row.motion == name]
        for variant in dict.fromkeys(row.variant for row in of_motion):
            of_variant = [row for row in of_motion if row.variant == variant]
            runs = [row for row in of_variant if row.robot is not None and row.controller == controller]
            successes = sum(bool(row.success) for row in runs)
            success = (
                Success(successes / len(runs), len(runs), *clopper_pearson(successes, len(runs))) if runs else None
            )
            duration, reason = of_variant[0].duration, of_variant[0].reason
            by_motion.setdefault(name, {})[variant] = TypicalResult(success, duration, reason)
    return by_motion
