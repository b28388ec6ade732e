# SPDX-License-Identifier: Apache-2.0
"""The rules by which a measured value is judged against what the thesis reports. All are fixed beforehand."""

from __future__ import annotations

import math
from collections.abc import Sequence
from enum import StrEnum
from typing import NamedTuple

import numpy as np

from fivebar_bringup.units import engineering, error_of


class Verdict(StrEnum):
    """Outcome of a comparison with the thesis."""

    AGREED = "agreed"
    BETTER = "better"
    NOT_REPRODUCED = "not reproduced"
    UNDECIDED = "undecided"


class Judgement(NamedTuple):
    """A verdict, the rule that gave it, and the values that decided."""

    verdict: Verdict
    rule: str
    reason: str


def undecided(judged: Judgement, why: str) -> Judgement:
    """Return a judgement that would agree as undecided, since what was measured cannot decide; any other stays."""
    if judged.verdict == Verdict.NOT_REPRODUCED:
        return judged
    return judged._replace(verdict=Verdict.UNDECIDED, reason=f"{judged.reason}; {why}")


ORDER = math.sqrt(10.0)
"""A value is of the order 10^n where it is within this factor of 10^n."""

FINITE_TORQUE = 10.0
"""Torques (Nm) that the drives can give; a law that never asks for more crosses with finite torque."""

IMU_RATIO = 1.2
"""Largest acceptable ratio of an acceleration error to the noise floor of the sensor."""


def order_of_magnitude(measured: float | None, reported: float, unit: str) -> Judgement:
    """Judge an error that the thesis reports by its order."""
    low, high = reported / ORDER, reported * ORDER
    rule = (
        f"of the order {reported:.0e} {unit} is {low:.1e} to {high:.1e} {unit}: agreed within, better below,"
        " not reproduced above"
    )
    if measured is None:
        return Judgement(Verdict.NOT_REPRODUCED, rule, "no such value was measured")
    value = f"{error_of(measured, unit)} ({measured:.2e} {unit})"
    if measured < low:
        return Judgement(Verdict.BETTER, rule, f"{value} is below {low:.1e} {unit}")
    if measured <= high:
        return Judgement(Verdict.AGREED, rule, f"{value} is of that order")
    return Judgement(Verdict.NOT_REPRODUCED, rule, f"{value} is above {high:.1e} {unit}")


def finite_torque(completed: Sequence[bool], peaks: Sequence[float | None]) -> Judgement:
    """Judge that runs were completed and that no requested torque was beyond the drives."""
    rule = f"agreed where every run is completed and no requested torque exceeds {FINITE_TORQUE:g} Nm"
    known = [math.inf if peak is None else peak for peak in peaks]
    largest = max(known, default=math.inf)
    done = sum(completed)
    reason = f"{done} of {len(completed)} runs completed, {largest:.3g} Nm requested at most"
    good = len(completed) > 0 and done == len(completed) and largest <= FINITE_TORQUE
    return Judgement(Verdict.AGREED if good else Verdict.NOT_REPRODUCED, rule, reason)


def only_one_side_finite(finite: Judgement, others: Sequence[float | None]) -> Judgement:
    """Judge that some laws need finite torque where another requests more than the drives have, in every run."""
    rule = f"agreed where that holds for the blended laws and computed torque requests over {FINITE_TORQUE:g} Nm always"
    beyond = sum(1 for peak in others if peak is None or peak > FINITE_TORQUE)
    known = [peak for peak in others if peak is not None]
    least = f"{min(known):.3g} Nm at least" if known else "no finite value"
    reason = f"{finite.reason}; computed torque beyond the drives in {beyond} of {len(others)} runs ({least})"
    good = finite.verdict == Verdict.AGREED and len(others) > 0 and beyond == len(others)
    return Judgement(Verdict.AGREED if good else Verdict.NOT_REPRODUCED, rule, reason)


def counted(found: Sequence[int], planned: int, what: str) -> Judgement:
    """Judge that every run counts as many events as planned."""
    rule = f"agreed where every run has {planned} {what}"
    good = len(found) > 0 and all(number == planned for number in found)
    reason = f"found {', '.join(map(str, sorted(set(found)))) or 'no number of'} {what} in {len(found)} runs"
    return Judgement(Verdict.AGREED if good else Verdict.NOT_REPRODUCED, rule, reason)


def vanishing(largest: float, scale: float, tolerance: float, unit: str) -> Judgement:
    """Judge that a quantity is zero but for rounding."""
    rule = f"agreed where the largest is at most {tolerance:.0e} of the largest force"
    reason = f"{largest:.1e} {unit} against {scale:.3g} {unit}"
    good = scale > 0.0 and largest <= tolerance * scale
    return Judgement(Verdict.AGREED if good else Verdict.NOT_REPRODUCED, rule, reason)


def as_printed(largest_difference: float, tolerance: float) -> Judgement:
    """Judge that a printed numerical result comes out again."""
    rule = f"agreed where no entry differs by more than {tolerance:g} from the printed one"
    good = largest_difference <= tolerance
    reason = f"the largest difference is {largest_difference:.3g}"
    return Judgement(Verdict.AGREED if good else Verdict.NOT_REPRODUCED, rule, reason)


class PairedRuns(NamedTuple):
    """One run with a measure taken and without it: whether each was completed, and each one's error."""

    label: str
    completed_with: bool
    completed_without: bool
    error_with: float | None
    error_without: float | None

    @property
    def ratio(self) -> float:
        """How many times larger the error is without; infinite where it is not known."""
        if self.error_without is None:
            return math.inf
        if not self.error_with:
            return 1.0 if self.error_without == 0.0 else math.inf
        return self.error_without / self.error_with


NEED_RULE = (
    "needed where some run is completed only with it, or has without it more than √10 times the error of the constraint"
)


def shown_necessary(pairs: Sequence[PairedRuns]) -> Judgement:
    """Judge the claim that a measure is necessary."""
    needed, reason = _need(pairs)
    return Judgement(Verdict.AGREED if needed else Verdict.NOT_REPRODUCED, f"{NEED_RULE}; agreed if so", reason)


def _need(pairs: Sequence[PairedRuns]) -> tuple[bool, str]:
    saved = [pair.label for pair in pairs if pair.completed_with and not pair.completed_without]
    worst = max(pairs, key=lambda pair: pair.ratio)
    done_with = sum(pair.completed_with for pair in pairs)
    done_without = sum(pair.completed_without for pair in pairs)
    reason = (
        f"completed {done_with} of {len(pairs)} with it and {done_without} of {len(pairs)} without;"
        f" the error grows at most {worst.ratio:.2f} times without ({worst.label})"
    )
    return bool(saved) or worst.ratio > ORDER, reason


def shown_unnecessary(
    completed: Sequence[bool], errors: Sequence[float | None], reported: float, unit: str
) -> Judgement:
    """Judge the claim that a law does its work without help: all completed, no error beyond the reported order."""
    limit = reported * ORDER
    rule = f"agreed where every run is completed without it and no error is above {limit:.1e} {unit}"
    largest = max((math.inf if error is None else error for error in errors), default=math.inf)
    reason = f"{sum(completed)} of {len(completed)} runs completed, error {error_of(largest, unit)} at most"
    good = len(completed) > 0 and all(completed) and largest <= limit
    return Judgement(Verdict.AGREED if good else Verdict.NOT_REPRODUCED, rule, reason)


STIFF = 0.9
"""Least part of the gain with which a law is said to hold a path."""


def more_accurate(ratios: Sequence[float], shares: Sequence[float]) -> Judgement:
    """Judge that one law is more accurate than another.

    Args:
        ratios: of their errors, run by run, with the other law as corrected here.
        shares: stiffness of the other law over its gain at each crossing, as printed.
    """
    rule = (
        "agreed where the other law's error is at least 1.1 times as large in the median run, or where as printed it"
        f" holds some path with less than {STIFF:g} of its gain"
    )
    middle = sorted(ratios)[len(ratios) // 2] if ratios else 0.0
    least = min(shares, default=1.0)
    median = f"{middle:.3f} times as large in the median run" if ratios else "not known"
    reason = f"as printed the least stiffness is {least:.2f} of the gain; as corrected the error is {median}"
    return Judgement(Verdict.AGREED if middle >= 1.1 or least < STIFF else Verdict.NOT_REPRODUCED, rule, reason)


def near_noise(outside: Sequence[float | None], whole: Sequence[float | None]) -> Judgement:
    """Judge an acceleration error against the sensor's noise.

    Args:
        outside: ratios of error and noise floor outside the blending zones, run by run.
        whole: the same over whole runs.
    """
    rule = (
        f"agreed where the error over the whole run, blending zones included, is at most {IMU_RATIO:g} times the noise"
        " floor, and outside the zones too"
    )
    beside, over = (
        max((math.inf if ratio is None else ratio for ratio in ratios), default=math.inf) for ratios in (outside, whole)
    )
    verdict = Verdict.AGREED if max(beside, over) <= IMU_RATIO else Verdict.NOT_REPRODUCED
    return Judgement(verdict, rule, f"the ratio is {over:.3f} at most, {beside:.3f} outside the zones")


def within(errors: Sequence[float | None], limit: float) -> Judgement:
    """Judge errors (m) against an accuracy that was asked for."""
    rule = f"agreed where no error is above {engineering(limit, 'm')}"
    largest = max((math.inf if error is None else error for error in errors), default=math.inf)
    reason = f"the largest of {len(errors)} is {error_of(largest if math.isfinite(largest) else None, 'm')}"
    return Judgement(Verdict.AGREED if largest <= limit else Verdict.NOT_REPRODUCED, rule, reason)


def quartiles(values: Sequence[float | None]) -> tuple[float, float, float] | None:
    """Return the lower quartile, the median and the upper quartile of the known values."""
    known = [value for value in values if value is not None]
    if not known:
        return None
    low, middle, high = np.quantile(known, (0.25, 0.5, 0.75)).tolist()
    return low, middle, high


def some_fail(failed: int, total: int, others_failed: int, others_total: int) -> Judgement:
    """Judge that a method may fail where a condition is broken, and does not where it holds."""
    rule = "agreed where at least one run fails or saturates without the condition and none does with it"
    reason = f"{failed} of {total} without it, {others_failed} of {others_total} with it"
    good = failed > 0 and others_failed == 0 and others_total > 0
    return Judgement(Verdict.AGREED if good else Verdict.NOT_REPRODUCED, rule, reason)


def some_not_across(across: Sequence[bool]) -> Judgement:
    """Judge that a method may not get across: some run does not make the planned changes of assembly mode."""
    rule = "agreed where at least one run does not make its planned changes of assembly mode"
    stuck = sum(not crossed for crossed in across)
    reason = f"{stuck} of {len(across)} runs do not get across"
    return Judgement(Verdict.AGREED if stuck > 0 else Verdict.NOT_REPRODUCED, rule, reason)


def some_setting_works(completed: dict[str, tuple[int, int]]) -> Judgement:
    """Judge that a threshold can be found by trial: with one of the settings all runs are completed."""
    rule = "agreed where with one of the thresholds tried every run is completed within the drives' torque"
    works = [name for name, (done, total) in completed.items() if total > 0 and done == total]
    reason = ", ".join(f"{name}: {done} of {total}" for name, (done, total) in completed.items())
    return Judgement(Verdict.AGREED if works else Verdict.NOT_REPRODUCED, rule, reason)
