"""The odds of a motion: how many of the robots that it may turn out to run on make it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, NamedTuple

from fivebar_bringup.odds.intervals import Interval, clopper_pearson


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
    made, robots = content["successes"], content["robots"]
    words = f"{made} of {robots}" if short else odds_words(made, robots, *content["interval_95"])
    better = content.get("better")
    if better is None:
        return words
    return f"{words}; better in {better['duration_s']:.3g} s{better.get('how', '')}: {told_odds(better, True)}"


def kept_odds(odds: Odds | None, chosen: str = "") -> dict[str, Any] | None:
    """Return odds as they are kept with a run, with what was chosen for them; None where they are not known."""
    return None if odds is None else {**odds.as_dict(), "chosen": chosen}
