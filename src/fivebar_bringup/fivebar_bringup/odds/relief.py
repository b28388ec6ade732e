"""Changes that raise the odds of a motion most: each declared uncertainty is removed in turn, on the same robots."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
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
    found = [
        Relief(words, trials_of(scenario, exact, seed, robots).odds) for words, exact in _with_one_error_less(errors)
    ]
    return sorted(found, key=lambda one: -one.odds.successes)


def most_relieved(
    scenario: Scenario, errors: RobotErrors, seed: int, odds: Odds, robots: Sequence[int] = OTHER_ROBOTS
) -> str:
    """Return in words what would raise the odds most that these robots have; "" where nothing does.

    A remedy is tried on no more robots than decide whether it is the best, which are fewest where the robots that have
    failed come first.
    """
    best, found = odds.successes + LEAST_GAIN - 1, ""
    for words, exact in _with_one_error_less(errors):
        tried = trials_of(scenario, exact, seed, robots, failures=len(robots) - best - 1).odds
        if tried.robots == len(robots) and tried.successes > best:
            best, found = tried.successes, f"with {words} {tried.successes} of {tried.robots} would"
    return found


def _with_one_error_less(errors: RobotErrors) -> Iterator[tuple[str, RobotErrors]]:
    """Yield each remedy in words that takes something away, and the errors with it."""
    for remedy in REMEDIES:
        without: dict[str, Any] = dict.fromkeys(remedy.errors, 0.0)
        exact = errors._replace(**without)
        if exact != errors:
            yield remedy.words, exact
