# SPDX-License-Identifier: Apache-2.0
"""The odds of a motion: when a run is a success, and how many of the robots that may have to make it do."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any, NamedTuple

from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.loop.closed_loop import FAULT_NAMES
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.scenario.robot_defaults import ERROR_TOLERANCE
from fivebar_control.trajectory.path_distance import KEPT_TO, PATH, TIMED, judged_distance
from fivebar_description.rounding import in_millimetres

CONFIDENCE = 0.95

PEAK_LIMIT = ERROR_TOLERANCE
"""A success stays within this distance (m) of its reference throughout."""

FINAL_LIMIT = 1e-3
"""A success ends within this distance (m) of its reference."""


ERROR_LIMITS = {"peak error": 1.0, "path error": 1.0, "final error": FINAL_LIMIT / PEAK_LIMIT}
"""Errors by which a run falls short, and their limits as shares of that of the peak."""

_ERROR = re.compile(rf"(?P<kind>{'|'.join(ERROR_LIMITS)}) (?P<mm>[\d.]+) mm")


class Interval(NamedTuple):
    """An interval of shares."""

    low: float
    high: float


def clopper_pearson(successes: int, runs: int) -> Interval:
    """Return the exact interval of a share for 95 %, by C. J. Clopper and E. S. Pearson (1934)."""
    # here, because scipy takes long to load
    from scipy.special import betaincinv

    tail = 0.5 * (1.0 - CONFIDENCE)
    low = 0.0 if successes == 0 else float(betaincinv(successes, runs - successes + 1, tail))
    high = 1.0 if successes == runs else float(betaincinv(successes + 1, runs - successes, 1.0 - tail))
    return Interval(low, high)


def upper_bound(successes: int, runs: int) -> float:
    """Return what a share exceeds with 5 % confidence only: the one-sided bound, of at least one run."""
    # here, because scipy takes long to load
    from scipy.special import betaincinv

    return 1.0 if successes == runs else float(betaincinv(successes + 1, runs - successes, CONFIDENCE))


class Odds(NamedTuple):
    """How many of some robots make a motion; no robot says nothing."""

    successes: int = 0
    robots: int = 0

    @property
    def share(self) -> float:
        """The share of robots that make it; 0 for no robots."""
        return self.successes / self.robots if self.robots else 0.0

    @property
    def interval(self) -> Interval:
        """The exact interval of the probability for 95 %."""
        return clopper_pearson(self.successes, self.robots) if self.robots else Interval(0.0, 1.0)

    def as_dict(self) -> dict[str, Any]:
        """Return the odds as plain numbers, shares between 0 and 1."""
        low, high = self.interval
        return {"successes": self.successes, "robots": self.robots, "share": self.share, "interval_95": [low, high]}

    def __add__(self, other: object) -> Odds:
        """Return the odds on both numbers of robots."""
        if not isinstance(other, Odds):
            return NotImplemented
        return Odds(self.successes + other.successes, self.robots + other.robots)

    def __str__(self) -> str:
        """Return the odds for a person."""
        return odds_words(*self, *self.interval)


def odds_words(successes: int, robots: int, low: float, high: float) -> str:
    """Return odds with their interval for a person."""
    if not robots:
        return "not known: no robots were drawn"
    share = f"{successes / robots:.0%}"
    return f"{successes} of {robots} drawn robots succeed: {share}, with 95 % confidence {low:.0%} to {high:.0%}"


def told_odds(content: Mapping[str, Any], short: bool = False) -> str:
    """Return for a person what `goal/status` tells of odds, in full or in short."""
    if "unknown" in content:
        return "not known" if short else f"not known: {content['unknown']}"
    successes, robots = content["successes"], content["robots"]
    words = f"{successes} of {robots}" if short else odds_words(successes, robots, *content["interval_95"])
    better = content.get("better")
    if better is None:
        return words
    return f"{words}; better in {better['duration_s']:.3g} s{better.get('how', '')}: {told_odds(better, True)}"


def kept_odds(odds: Odds | None, chosen: str = "") -> dict[str, Any] | None:
    """Return odds as they are kept with a run, with what was chosen for them; None where they are not known."""
    return None if odds is None else {**odds.as_dict(), "chosen": chosen}


def success_rule(scale: float = 1.0, judge: str = TIMED) -> str:
    """Return the definition of a success in words, fixed before any run; distances go with the size of a robot."""
    end = "the goal" if judge == PATH else "it"
    return (
        "all samples without a fault, the planned change of assembly mode, and a distance from the"
        f" {KEPT_TO[judge]} that is always below {1e3 * scale * PEAK_LIMIT:.3g} mm, and below"
        f" {1e3 * scale * FINAL_LIMIT:.3g} mm from {end} at the end"
    )


def failures_in_words(missed: Iterable[str], peak_limit: float) -> str:
    """Return in words how runs fall short, the most frequent way first.

    Args:
        missed: the first shortcoming of each.
        peak_limit: as for `shortcomings`.
    """
    ways: dict[str, list[float]] = {}
    for shortcoming in missed:
        error = _ERROR.fullmatch(shortcoming)
        ways.setdefault(error["kind"] if error else shortcoming, []).append(float(error["mm"]) if error else 0.0)
    words = []
    for way, errors in sorted(ways.items(), key=lambda item: -len(item[1])):
        count = len(errors)
        if way not in ERROR_LIMITS:
            words.append(f"{count} with {way}")
            continue
        limit = peak_limit * ERROR_LIMITS[way]
        words.append(f"{count} with a {way} of up to {max(errors):.3g} mm (limit {in_millimetres(limit)})")
    return ", ".join(words)


def shortcomings(
    outcome: RunMetrics,
    planned_samples: int,
    planned_mode_changes: int,
    peak_limit: float = PEAK_LIMIT,
    judge: str = TIMED,
) -> list[str]:
    """Return how a run falls short of a success, worst first; nothing for a success.

    Args:
        outcome: of the run.
        planned_samples, planned_mode_changes: of its plan.
        peak_limit: largest distance from the reference (m); half of it is that at the end.
        judge: whether the distance from the path counts instead, but for the end.
    """
    missed = []
    if outcome.fault != NO_FAULT:
        missed.append(f"fault {FAULT_NAMES[outcome.fault]}")
    elif outcome.samples != planned_samples:
        missed.append(f"{outcome.samples} of {planned_samples} samples")
    if outcome.mode_changes != planned_mode_changes:
        missed.append(f"{outcome.mode_changes} changes of assembly mode, planned {planned_mode_changes}")
    # a NaN is no success
    peak = judged_distance(judge, outcome.error_peak, outcome.path_error)
    if not peak < peak_limit:
        missed.append(f"{'peak' if judge == TIMED else 'path'} error {in_millimetres(peak)}")
    if not outcome.error_final < peak_limit * ERROR_LIMITS["final error"]:
        missed.append(f"final error {in_millimetres(outcome.error_final)}")
    return missed
