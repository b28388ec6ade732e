"""The crossings of the benchmark: read from the file that is shipped, and drawn, once, for that file.

`python -m fivebar_bringup.studies.benchmark.crossings` prints the file.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from functools import cache
from itertools import count, islice
from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.scenario import Scenario
from fivebar_bringup.studies.engine.table import RowTable
from fivebar_bringup.studies.rigs.rig import find_rig
from fivebar_bringup.studies.sweep.drawing import PLANNED_FOR, RATE_HZ, ROBOT, Draw, draw, on_robot
from fivebar_bringup.studies.sweep.screening import limits_for
from fivebar_control.planning.feasibility import screen
from fivebar_description.share import share_file
from fivebar_description.strict_yaml import InputError

SEED = 1914
"""Of the crossings, and of the robots of every rig."""

CROSSINGS = 1000

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

    def on(self, rig: str) -> Draw:
        """Return the crossing with the robot that a rig has for it."""
        case = Draw(*self[:8], 1.0, 1.0, 1.0, None, 0, seed=SEED)
        return on_robot(case, rig)


TABLE = RowTable(BenchmarkCrossing)
"""The table of the file."""


@cache
def benchmark() -> list[BenchmarkCrossing]:
    """Return the crossings, from the file that is shipped."""
    return TABLE.read(shipped().read_text(encoding="utf-8").removeprefix(TABLE.head))


def shipped() -> Path:
    """Return the file of the crossings."""
    return share_file("fivebar_bringup", "config", "benchmark", "crossings.csv")


def checked_rigs(names: Sequence[str]) -> Sequence[str]:
    """Return names or paths of rigs whose robots can make the crossings.

    Raises:
        InputError: one of them has another robot.
    """
    for name in names:
        robot = find_rig(name).robot
        if robot != ROBOT:
            raise InputError(f"--rig: {name!r}: has the robot {robot}: expected rigs of {ROBOT}, as the crossings are")
    return names


def drawn_crossings() -> Iterator[BenchmarkCrossing]:
    """Yield crossings: those of a sweep's cases, rounded, that can be made at all.

    The planner accepts it, and the reference asks for no more than the drives have, is not too long near the locus and
    rests at a distance from it; no controller is asked.
    """
    accepted = 0
    for number in count():
        case = draw(SEED, number, "ideal")
        found = BenchmarkCrossing(
            accepted,
            case.mode1,
            case.mode2,
            round(case.start_x, 5),
            round(case.start_y, 5),
            round(case.end_x, 5),
            round(case.end_y, 5),
            # a whole number of samples
            round(case.duration * RATE_HZ) / RATE_HZ,
            0,
        )
        case = found.on("ideal")
        try:
            # as a scenario that plans for its own controller
            plan = Scenario.model_validate(case.with_effects(WITH_ZONES, {}).model_dump()).plan()
        except InputError:
            continue
        scenario = case.scenario(PLANNED_FOR)
        if screen(scenario.five_bar(), plan, RATE_HZ, scenario.tuned(), limits_for(case, scenario)).feasible:
            accepted += 1
            yield found._replace(mode_changes=len(plan.crossings))


if __name__ == "__main__":
    print(TABLE.head + TABLE.lines(islice(drawn_crossings(), CROSSINGS)), end="")
