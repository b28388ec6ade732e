# SPDX-License-Identifier: Apache-2.0
"""How many runs of random crossings stay within the tube that is computed before them.

`python docs/studies/tube_study.py OUT.csv [--controller mpc] [--crossings 240] [--seed N]` takes the
first crossings of a sweep that the screen accepts, runs each as believed and on a robot off the model, and prints the
table of docs/bounds.md; a study that was interrupted is continued. Runs that ask a motor for its limit are counted
apart: the tube knows of no limit.
"""

from __future__ import annotations

import argparse
import csv
from collections.abc import Iterable, Iterator, Sequence
from itertools import islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fivebar_bringup.odds.odds import clopper_pearson
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import traced_crossing
from fivebar_control.compiling import expect_many_motions
from fivebar_control.laws.gains import UnifiedSettings
from fivebar_control.laws.mpc import MpcSettings
from fivebar_control.loop.sampled_plan import X, Y, sampled
from fivebar_control.model.kinematics import state_from_joints
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.scenario.law_settings import tuned_controller
from fivebar_description.rounding import in_millimetres
from fivebar_studies.sweep.drawing import PLANNED_FOR, RATE_HZ, Draw, draw
from fivebar_studies.sweep.planning import accepted, planned
from tube import Mismatch, tube

RIG = "ideal"

BELIEVED, OFF_MODEL = "as believed", "off the model"
MISMATCHES = {BELIEVED: Mismatch(), OFF_MODEL: Mismatch(scale=0.1, friction=0.2)}
"""How far the robots are from their model at most; those off the model are drawn uniformly within that."""

ROBOT_STREAM = 11
"""Random stream of a crossing's robot off the model."""

AT_LIMIT = 1e-6
"""Share of the torque limit by which a request that stays below it has not reached it."""


class TubeRun(NamedTuple):
    """A run and its tube.

    Attributes:
        number: of the case in the sweep.
        robots: key of `MISMATCHES`.
        limited: whether a motor was asked for its limit, or for more.
        share: largest share of the radius that the run used at any sample; infinite for a run that was stopped.
        radius: largest of the tube (m).
        error: largest of the run (m).
    """

    number: int
    robots: str
    limited: bool
    share: float
    radius: float
    error: float

    @property
    def inside(self) -> bool:
        """Whether it stayed within the tube at every sample."""
        return self.share < 1.0


def believed_crossings(seed: int) -> Iterator[Draw]:
    """Yield the crossings of a sweep that the planner and the screen accept, on the robot as believed."""
    return accepted(
        lambda number: draw(seed, number, RIG)._replace(mass_scale=1.0, inertia_scale=1.0, friction_scale=1.0)
    )


def off_model(case: Draw) -> Draw:
    """Return a case on a robot that is off the model by no more than the mismatch."""
    most = MISMATCHES[OFF_MODEL]
    random = np.random.default_rng((case.seed, case.number, ROBOT_STREAM))
    mass, inertia = random.uniform(1.0 - most.scale, 1.0 + most.scale, 2).tolist()
    friction = float(random.uniform(1.0 - most.friction, 1.0 + most.friction))
    return case._replace(mass_scale=mass, inertia_scale=inertia, friction_scale=friction)


def tube_run(case: Draw, controller: str, robots: str) -> TubeRun:
    """Run an accepted case, and compare each sample of the run with the tube for a key of `MISMATCHES`."""
    scenario = case.scenario(controller)
    robot, actual, plan = scenario.five_bar(), scenario.actual_robot(), planned(case)
    settings = tuned_controller(scenario).nominal.settings
    assert isinstance(settings, UnifiedSettings | MpcSettings)
    radius = tube(robot, plan, RATE_HZ, settings, MISMATCHES[robots]).radius
    samples = sampled(robot, plan, RATE_HZ)
    outcome, trace = traced_crossing(case_of(scenario), samples)
    states = [state_from_joints(actual, *joints) for joints in trace[: len(radius), :8].tolist()]
    places = np.array([(state.x, state.y) for state in states])
    errors = np.hypot(*(places - samples.rows[: len(places), [X, Y]]).T)
    share = float(np.max(errors / radius[: len(errors)])) if outcome.fault == NO_FAULT else np.inf
    requested = max(outcome.requested1, outcome.requested2)
    limited = requested >= (1.0 - AT_LIMIT) * case.torque_limit
    return TubeRun(case.number, robots, limited, share, float(np.max(radius)), outcome.error_peak)


def table(controller: str, runs: Sequence[TubeRun]) -> str:
    """Return what the runs come to, in Markdown."""
    lines = [
        "| | runs | inside at every sample (95 %) | largest share of the radius used | radius, median and largest"
        " | error, median and largest |",
        "|---|---|---|---|---|---|",
    ]
    for limited, suffix in ((False, ""), (True, ", at a motor's limit")):
        for robots in MISMATCHES:
            chosen = [run for run in runs if run.robots == robots and run.limited == limited]
            if not chosen:
                continue
            inside = sum(run.inside for run in chosen)
            low, high = clopper_pearson(inside, len(chosen))
            lengths = " | ".join(
                f"{in_millimetres(float(np.median(values)), 3).removesuffix(' mm')}, {in_millimetres(max(values))}"
                for values in ([run.radius for run in chosen], [run.error for run in chosen])
            )
            lines.append(
                f"| `{controller}`, {robots}{suffix} | {len(chosen)} | {inside} ({low:.1%} to {high:.1%}) |"
                f" {max(run.share for run in chosen):.2f} | {lengths} |"
            )
    return "\n".join(lines)


def read(lines: Iterable[str]) -> list[TubeRun]:
    """Return the runs of a file."""
    return [
        TubeRun(int(number), robots, limited == str(True), float(share), float(radius), float(error))
        for number, robots, limited, share, radius, error in csv.reader(lines)
    ]


def main() -> None:
    """Run so many crossings, with their results in a file."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("out", type=Path, metavar="OUT.csv")
    parser.add_argument("--controller", default=PLANNED_FOR, choices=("unified", "mpc"))
    parser.add_argument("--crossings", type=int, default=240)
    parser.add_argument("--seed", type=int, default=52771)
    given = parser.parse_args()
    expect_many_motions()
    runs = read(given.out.read_text(encoding="utf-8").splitlines()) if given.out.exists() else []
    done = {(run.number, run.robots) for run in runs}
    with given.out.open("a", encoding="utf-8", newline="") as file:
        for case in islice(believed_crossings(given.seed), given.crossings):
            for robots, one in ((BELIEVED, case), (OFF_MODEL, off_model(case))):
                if (case.number, robots) not in done:
                    runs.append(tube_run(one, given.controller, robots))
                    csv.writer(file).writerow(runs[-1])
                    file.flush()
    print(table(given.controller, runs))


if __name__ == "__main__":
    main()
