# SPDX-License-Identifier: Apache-2.0
"""The law that keeps to the path against the one that follows it in time, on the same crossings under the same pushes.

`python docs/studies/path_study.py [--crossings 100] [--seed N] [--rig ideal]` takes so many random
crossings that the screen accepts for `unified`, pushes the platform on the locus in a random direction, and prints the
table of docs/laws.md: of each law how many stay within 2 mm of the timed reference, how many within 2 mm of the path,
and the distances.
"""

from __future__ import annotations

import argparse
import math
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np

from fivebar_bringup.odds.odds import PEAK_LIMIT
from fivebar_control.compiling import expect_many_motions
from fivebar_control.safety.stages import NO_FAULT
from fivebar_studies.sweep.drawing import Draw, draw
from fivebar_studies.sweep.planning import accepted, planned
from fivebar_studies.sweep.running import run_and_judge
from fivebar_studies.sweep.statistics import share_words

LAWS, FORCES, LENGTH, STREAM = ("unified", "path"), (0.0, 1.0, 4.0), 0.05, 13
"""Laws that are compared, pushes (N), how long they are (s), and the random stream of their directions."""


class PathRun(NamedTuple):
    """A crossing: largest distances (m) from the timed reference and the path, and the one at the end.

    They are infinite where the run stopped or ended in another assembly mode.
    """

    timed: float
    path: float
    final: float


def single_crossings(seed: int, rig: str) -> Iterator[Draw]:
    """Yield random motions with one crossing that the screen accepts."""
    cases = accepted(lambda number: draw(seed, number, rig))
    return (case for case in cases if len(planned(case).crossings) == 1)


def path_run(case: Draw, law: str, force: float) -> PathRun:
    """Run a crossing by a law under a push (N) that meets it on the locus."""
    plan, scenario = planned(case), case.scenario(law)
    heading = float(np.random.default_rng((case.seed, case.number, STREAM)).uniform(-math.pi, math.pi))
    start = max(0.0, plan.crossings[0].time - 0.5 * LENGTH)
    push = scenario.plant.push._replace(force=force, heading=heading, start=start, length=LENGTH)
    plant = scenario.plant._replace(push=push)
    outcome, _ = run_and_judge(scenario.model_copy(update={"plant": plant, "tracking_error_limit": 0.05}), plan)
    if outcome.fault != NO_FAULT or outcome.mode_changes != len(plan.crossings):
        return PathRun(math.inf, math.inf, math.inf)
    return PathRun(outcome.error_peak, outcome.path_error, outcome.error_final)


def line(law: str, force: float, runs: Sequence[PathRun]) -> str:
    """Return a line of the table, in Markdown."""
    timed, path = ([run.timed for run in runs], [run.path for run in runs])
    near = (share_words(sum(error < PEAK_LIMIT for error in errors), len(runs), 0) for errors in (timed, path))
    end = [run.final for run in runs if math.isfinite(run.final)]
    return (
        f"| {force:g} N | `{law}` | {' | '.join(near)} |"
        f" {1e3 * np.median(timed):.2f} mm | {1e3 * np.median(path):.3f} mm |"
        f" {1e3 * max(end, default=math.inf):.2f} mm |"
    )


def main(arguments: Sequence[str] | None = None) -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--crossings", type=int, default=100)
    parser.add_argument("--seed", type=int, default=404041)
    parser.add_argument("--rig", default="ideal")
    options = parser.parse_args(arguments)
    expect_many_motions()
    cases = list(islice(single_crossings(options.seed, options.rig), options.crossings))
    print(
        "| push | law | within 2 mm of the timed reference | of the path | median, timed | median, path | worst end |"
    )
    print("|---|---|---|---|---|---|---|")
    for force in FORCES:
        for law in LAWS:
            print(line(law, force, [path_run(case, law, force) for case in cases]), flush=True)


if __name__ == "__main__":
    main()
