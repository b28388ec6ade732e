"""Changes that raise the odds of a motion most: each declared uncertainty is removed in turn, on the same robots."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.robot_errors import RobotErrors
from fivebar_bringup.odds.trials import OTHER_ROBOTS, trials_of
from fivebar_bringup.scenario import Scenario

LEAST_GAIN = 2
"""Robots that have to succeed in addition for a remedy to be named."""


class Remedy(NamedTuple):
    """A remedy in words, and the errors that it removes."""

    words: str
    errors: tuple[str, ...]


REMEDIES = (
    Remedy("exact lengths and zeros (fivebar calibrate)", ("length", "base", "zero")),
    Remedy(
        "known masses, friction and torque constants (fivebar identify)",
        ("mass_and_inertia", "coulomb_friction", "torque_constant"),
    ),
    Remedy("a level base", ("tilt",)),
    Remedy("no push", ("push",)),
)


class Relief(NamedTuple):
    """The odds with one uncertainty less."""

    words: str
    odds: Odds


def reliefs(scenario: Scenario, errors: RobotErrors, seed: int, robots: Sequence[int]) -> list[Relief]:
    """Return the odds with each declared uncertainty taken away, the best first; arguments as for `trials_of`."""
    found = []
    for remedy in REMEDIES:
        without: dict[str, Any] = dict.fromkeys(remedy.errors, 0.0)
        exact = errors._replace(**without)
        if exact != errors:
            found.append(Relief(remedy.words, trials_of(scenario, exact, seed, robots).odds))
    return sorted(found, key=lambda one: -one.odds.successes)


def most_relieved(scenario: Scenario, errors: RobotErrors, seed: int, odds: Odds, robots: range = OTHER_ROBOTS) -> str:
    """Return in words what would raise the odds most that these robots have; "" where nothing does."""
    best = next(iter(reliefs(scenario, errors, seed, robots)), None)
    if best is None or best.odds.successes < odds.successes + LEAST_GAIN:
        return ""
    return f"with {best.words} {best.odds.successes} of {best.odds.robots} would"
