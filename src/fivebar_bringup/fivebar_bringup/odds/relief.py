# SPDX-License-Identifier: Apache-2.0
"""Changes that raise the odds of a motion most: each declared uncertainty is removed in turn, on the same robots."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, NamedTuple

from fivebar_bringup.odds.odds import Odds
from fivebar_bringup.odds.robot_errors import ASSUMED_GYRO_BIAS, RobotErrors
from fivebar_bringup.odds.trials import OTHER_ROBOTS, trials_of
from fivebar_bringup.scenario import Scenario
from fivebar_description.imu import ImuSettings
from fivebar_description.loads import Loads
from fivebar_description.tolerances import Tolerances

LEAST_GAIN = 2
"""Robots that have to succeed in addition for a remedy to be named."""


CALIBRATED = Tolerances(length=2e-5, base=2e-5, zero=2e-4)
"""Tolerances of a calibrated robot. The estimator of one whose errors are removed counts on these: one that counts on
none takes every other error for a contradiction."""


def calibrated(tolerances: Tolerances, names: Iterable[str]) -> Tolerances:
    """Return tolerances, some of them as of a calibrated robot where they are not smaller already."""
    known = {name: min(getattr(tolerances, name), getattr(CALIBRATED, name)) for name in names}
    return tolerances._replace(**known)


class Remedy(NamedTuple):
    """A remedy in words, and the errors that it removes; with those of tolerances the estimator knows the robot."""

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


PASSIVE = "frictionless passive joints"

FRICTIONLESS = 1e-9
"""Friction (Nm) in place of none."""

GYROSCOPE = "a gyroscope on a distal link (imu: in the robot file)"

MEMS = ImuSettings(gyro_noise=0.01, rate_hz=250, latency=0.004)
"""A gyroscope that a robot without one could have."""


class Relief(NamedTuple):
    """The odds with one uncertainty less."""

    words: str
    odds: Odds


def reliefs(scenario: Scenario, errors: RobotErrors, seed: int, robots: Sequence[int]) -> list[Relief]:
    """Return the odds with each declared uncertainty taken away, the best first; arguments as for `trials_of`."""
    by_remedy = [
        Relief(words, trials_of(relieved, exact, seed, robots).odds)
        for words, relieved, exact in _remedied(scenario, errors)
    ]
    return sorted(by_remedy, key=lambda relief: -relief.odds.successes)


def most_relieved(
    scenario: Scenario, errors: RobotErrors, seed: int, odds: Odds, robots: Sequence[int] = OTHER_ROBOTS
) -> str:
    """Return in words what would raise the odds most that these robots have; "" where nothing does.

    A remedy is tried on no more robots than decide whether it is the best, which are fewest where the robots that have
    failed come first.
    """
    best, relief = odds.successes + LEAST_GAIN - 1, ""
    for words, relieved, exact in _remedied(scenario, errors):
        tried = trials_of(relieved, exact, seed, robots, failures=len(robots) - best - 1).odds
        if tried.robots == len(robots) and tried.successes > best:
            best, relief = tried.successes, f"with {words} {tried.successes} of {tried.robots} would succeed"
    return relief


def _remedied(scenario: Scenario, errors: RobotErrors) -> Iterator[tuple[str, Scenario, RobotErrors]]:
    """Yield each remedy in words that changes something, with the scenario and the errors that it leaves."""
    for remedy in REMEDIES:
        without: dict[str, Any] = dict.fromkeys(remedy.errors, 0.0)
        exact = errors._replace(**without)
        if exact != errors:
            known = calibrated(scenario.tolerances, set(remedy.errors) & set(Tolerances._fields))
            yield remedy.words, scenario.model_copy(update={"tolerances": known}), exact
    loads = scenario.to_bear()
    if max(loads.passive, scenario.plant.friction.passive) > 0.0:
        yield PASSIVE, _without_passive_friction(scenario, loads), errors
    if scenario.estimated and not scenario.gyro:
        ekf = scenario.ekf._replace(gyro=True, gyro_noise=MEMS.gyro_noise)
        yield (
            GYROSCOPE,
            scenario.model_copy(update={"imu": MEMS, "ekf": ekf}),
            errors._replace(gyro_bias=ASSUMED_GYRO_BIAS),
        )


def _without_passive_friction(scenario: Scenario, loads: Loads) -> Scenario:
    """Return a scenario whose robots have no friction in their passive joints, nor count on it."""
    plant = scenario.plant
    free = plant._replace(friction=plant.friction._replace(passive=0.0))
    # with all loads at 0 those of the robot's file would count again
    return scenario.model_copy(update={"plant": free, "loads": loads._replace(passive=FRICTIONLESS)})
