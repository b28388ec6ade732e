# SPDX-License-Identifier: Apache-2.0
"""The crossings of the benchmark: read from the file that is shipped, and drawn, once, for that file.

`python -m fivebar_studies.benchmark.crossings` prints the file.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache, lru_cache
from itertools import count, islice
from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.scenario import Scenario
from fivebar_control.planning.feasibility import screen
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_description.files import share_file
from fivebar_description.strict_yaml import InputError
from fivebar_studies.engine.table import RowTable
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.sweep.drawing import BASES, PLANNED_FOR, RATE_HZ, ROBOT, VARIED, Draw, draw, on_robot
from fivebar_studies.sweep.planning import limits_for

SEED = 1914
"""Seed of the crossings, and of the robots of every rig."""

CROSSINGS = 1000

ATTEMPTS = 1000
"""Draws for a crossing of a robot of another make; so many apart are those of the next one."""

WITH_ZONES = "multi_cartesian"
"""A controller with blending zones: what the planner refuses to these is left out, so that the set compares all."""


class BenchmarkCrossing(NamedTuple):
    """A crossing of the benchmark: a straight segment from rest to rest by the fifth-order polynomial.

    Attributes:
        crossing: number.
        mode1, mode2: working mode.
        start_x, start_y, end_x, end_y: rests (m) in different assembly modes.
        duration: s.
        mode_changes: of the assembly mode, on the way.
    """

    crossing: int
    mode1: int
    mode2: int
    start_x: float
    start_y: float
    end_x: float
    end_y: float
    duration: float
    mode_changes: int

    def on(self, rig: str, robot: str = "", seed: int = SEED) -> Draw:
        """Return the crossing with the robot that a rig has for it, or with one of another make on such a rig."""
        case = on_robot(Draw(*self[:8], 1.0, 1.0, 1.0, None, 0, seed=seed, robot=robot), rig)
        return case._replace(rig=VARIED) if robot else case


TABLE = RowTable(BenchmarkCrossing)
"""The table of the file."""


@cache
def benchmark() -> list[BenchmarkCrossing]:
    """Return the crossings, from the file that is shipped."""
    return TABLE.read(shipped().read_text(encoding="utf-8").removeprefix(TABLE.head))


def crossing_of(robot: str, number: int) -> BenchmarkCrossing:
    """Return a crossing by its number: of the file that is shipped, or drawn alike for a robot of another make."""
    return benchmark()[number] if robot == ROBOT else drawn_crossing(SEED, robot, number)


@lru_cache(maxsize=2 * CROSSINGS)
def drawn_crossing(seed: int, robot: str, number: int) -> BenchmarkCrossing:
    """Return a crossing that is drawn for a robot, by its number.

    Raises:
        InputError: the drives are too weak for any.
    """
    attempts = (draw(seed, number * ATTEMPTS + attempt, VARIED, robot) for attempt in range(ATTEMPTS))
    crossing = next(filter(None, (_accepted(case, number, robot) for case in attempts)), None)
    if crossing is None:
        raise InputError(
            f"--robot: {robot}: none of {ATTEMPTS} random crossings can be made: expected drives that are strong enough"
        )
    return crossing


def shipped() -> Path:
    """Return the file of the crossings."""
    return share_file("fivebar_bringup", "config", "benchmark", "crossings.csv")


def robot_of_all(names: Sequence[str], robot: str = "") -> str:
    """Return the robot whose crossings are made on rigs: theirs, or another one on those that draw no geometry.

    Args:
        names: of the rigs, or their paths.
        robot: the other one, "" for that of the rigs.

    Raises:
        InputError: the rigs have different robots, or cannot have the other one.
    """
    own = [find_rig(name).robot for name in names]
    for name, of_rig in zip(names, own, strict=True):
        if robot and name not in BASES:
            raise InputError(f"--rig: {name!r}: has the robot {of_rig}: expected {' or '.join(BASES)} with --robot")
        if of_rig != own[0]:
            raise InputError(f"--rig: {name!r}: has the robot {of_rig}: expected rigs of {own[0]}, as {names[0]!r} is")
    return robot or own[0]


def drawn_crossings() -> Iterator[BenchmarkCrossing]:
    """Yield crossings: those of a sweep's cases, rounded, that can be made at all.

    The planner accepts it, and the reference asks for no more than the drives have, is not too long near the locus and
    rests at a distance from it; no controller is asked.
    """
    accepted = 0
    for number in count():
        crossing = _accepted(draw(SEED, number, "ideal"), accepted)
        if crossing is not None:
            accepted += 1
            yield crossing


def _accepted(drawn: Draw, number: int, robot: str = "") -> BenchmarkCrossing | None:
    """Return what is drawn as a crossing of a number, None where it cannot be made."""
    crossing = BenchmarkCrossing(
        number,
        drawn.mode1,
        drawn.mode2,
        round(drawn.start_x, 5),
        round(drawn.start_y, 5),
        round(drawn.end_x, 5),
        round(drawn.end_y, 5),
        # a whole number of samples
        round(drawn.duration * RATE_HZ) / RATE_HZ,
        0,
    )
    case = crossing.on("ideal", robot)
    try:
        # as a scenario that plans for its own controller
        plan = Scenario.model_validate(case.with_effects(WITH_ZONES, {}).model_dump()).plan()
    except InputError:
        return None
    scenario = case.scenario(PLANNED_FOR)
    tuned, limits = tuned_controller(scenario), limits_for(case, scenario)
    feasible = screen(scenario.five_bar(), plan, RATE_HZ, tuned, limits).feasible
    return crossing._replace(mode_changes=len(plan.crossings)) if feasible else None


if __name__ == "__main__":
    print(TABLE.head + TABLE.lines(islice(drawn_crossings(), CROSSINGS)), end="")
