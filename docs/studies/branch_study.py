# SPDX-License-Identifier: Apache-2.0
"""The safety of crossing either branch of the Type 2 locus: distal links stretched, or folded onto each other.

`python docs/studies/branch_study.py [--crossings 450] [--seed N]` takes so many random crossings of
each branch that the screen accepts for `unified` with exact sensors and from encoders alone, and prints the table of
docs/bounds.md: each without a disturbance, under pushes at the crossing, and on two robots whose lengths differ from
their file, from encoders alone.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from itertools import count
from typing import NamedTuple

import numpy as np

from fivebar_bringup.odds.odds import PEAK_LIMIT
from fivebar_control.compiling import expect_many_motions
from fivebar_control.model.singularity import FOLDED, STRETCHED, DistalLinks, parallel_svd
from fivebar_control.safety.stages import NO_FAULT
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import Plan
from fivebar_description.strict_yaml import InputError
from fivebar_description.tolerances import Tolerances
from fivebar_studies.sweep.drawing import PLANNED_FOR, Draw, DrawnScenario, draw
from fivebar_studies.sweep.planning import planned, screened
from fivebar_studies.sweep.running import run_and_judge
from fivebar_studies.sweep.statistics import share_words

FORCES, LENGTH = (1.0, 2.0, 4.0), 0.05
"""Pushes along t_s, either way (N), and how long they are (s), with the crossing in the middle."""

OFF = Tolerances(length=5e-5, base=5e-5, zero=3.5e-4)
"""How far robots are off their file at most; the estimator knows it."""

ROBOTS, ROBOT_STREAM = 2, 7
"""Robots off their file for each crossing, and their random stream."""

LINKS, ZEROS = ("l_11", "l_12", "l_21", "l_22", "base_1", "base_2"), ("zero_1", "zero_2")


class BranchRun(NamedTuple):
    """A crossing of a branch, and what became of it.

    Attributes:
        branch: of the locus.
        kappa_rate: |d kappa / dt| of the reference there (1/s).
        alone: whether it succeeded without a disturbance.
        pushed: error under each of `FORCES`, the larger of both ways (m); infinite for a fault or a wrong mode.
        sensed: success of each robot off its file.
    """

    branch: DistalLinks
    kappa_rate: float
    alone: bool
    pushed: tuple[float, ...]
    sensed: tuple[bool, ...]


def accepted(seed: int, crossings: int) -> Iterator[tuple[Draw, Draw]]:
    """Yield so many crossings of each branch that the screen accepts, with exact sensors and from encoders alone."""
    left = dict.fromkeys((STRETCHED, FOLDED), crossings)
    for number in count():
        exact, encoders = draw(seed, number, "ideal"), draw(seed, number, "encoders")
        try:
            found = planned(exact).crossings
            wanted = len(found) == 1 and left[found[0].distal_links] > 0
            if wanted and all(screened(case, PLANNED_FOR).feasible for case in (exact, encoders)):
                left[found[0].distal_links] -= 1
                yield exact, encoders
        except InputError:
            continue
        if not any(left.values()):
            return


def branch_run(exact: Draw, encoders: Draw) -> BranchRun:
    """Run an accepted crossing."""
    plan, scenario = planned(exact), exact.scenario(PLANNED_FOR)
    (crossed,) = plan.crossings
    here = parallel_svd(desired_at(scenario.five_bar(), plan, crossed.time, plan.path.at(crossed.time)).state)
    pushed = tuple(
        max(_pushed(scenario, plan, force, math.atan2(sign * here.t_y, sign * here.t_x)) for sign in (1.0, -1.0))
        for force in FORCES
    )
    sensed = tuple(_succeeds(_off_file(encoders, robot), plan) for robot in range(ROBOTS))
    return BranchRun(crossed.distal_links, crossed.kappa_rate, _succeeds(scenario, plan), pushed, sensed)


def _succeeds(scenario: DrawnScenario, plan: Plan) -> bool:
    return not run_and_judge(scenario, plan)[1]


def _pushed(scenario: DrawnScenario, plan: Plan, force: float, heading: float) -> float:
    start = max(0.0, plan.crossings[0].time - 0.5 * LENGTH)
    push = scenario.plant.push._replace(force=force, heading=heading, start=start, length=LENGTH)
    outcome, _ = run_and_judge(scenario.model_copy(update={"plant": scenario.plant._replace(push=push)}), plan)
    lost = outcome.fault != NO_FAULT or outcome.mode_changes != len(plan.crossings)
    return math.inf if lost else outcome.error_peak


def _off_file(case: Draw, robot: int) -> DrawnScenario:
    random = np.random.default_rng((case.seed, case.number, robot, ROBOT_STREAM))
    effects = {
        "links": dict(zip(LINKS, random.uniform(-OFF.length, OFF.length, 6).tolist(), strict=True)),
        "encoders": dict(zip(ZEROS, random.uniform(-OFF.zero, OFF.zero, 2).tolist(), strict=True)),
        "seed": int(random.integers(2**31)),
    }
    return case.with_effects(PLANNED_FOR, effects).model_copy(update={"tolerances": OFF})


def table(runs: Sequence[BranchRun]) -> str:
    """Return what the runs come to, in Markdown."""
    by_branch = {branch: [run for run in runs if run.branch == branch] for branch in (STRETCHED, FOLDED)}
    rows = {"no disturbance": {name: [run.alone for run in found] for name, found in by_branch.items()}}
    for number, force in enumerate(FORCES):
        rows[f"{force:g} N along $t_s$ for {1e3 * LENGTH:g} ms"] = {
            name: [run.pushed[number] < PEAK_LIMIT for run in found] for name, found in by_branch.items()
        }
    rows["lengths ±0.05 mm, encoders alone"] = {
        name: [one for run in found for one in run.sensed] for name, found in by_branch.items()
    }
    lines = ["| within 2 mm | stretched (95 %) | folded (95 %) |", "|---|---|---|"]
    for words, found in rows.items():
        shares = (share_words(sum(values), len(values)) for values in found.values())
        lines.append(f"| {words} | {' | '.join(shares)} |")
    return "\n".join(lines)


def main() -> None:
    """Run so many crossings of each branch."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--crossings", type=int, default=450)
    parser.add_argument("--seed", type=int, default=8080)
    given = parser.parse_args()
    expect_many_motions()
    print(table([branch_run(*pair) for pair in accepted(given.seed, given.crossings)]))


if __name__ == "__main__":
    main()
