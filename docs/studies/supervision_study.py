# SPDX-License-Identifier: Apache-2.0
"""The three supervisions of a blended controller on the same random crossings.

`python docs/studies/supervision_study.py [--crossings 60] [--rigs RIG ...] [--seed N]` takes
crossings that the screen accepts for `multi_cartesian`, runs each by 1/cond(A) in the planned zones, by a sigmoid in
time, and in zones as wide as the estimated state's speed makes them, and prints how they end.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from itertools import islice
from typing import NamedTuple

import numpy as np

from fivebar_control.compiling import expect_many_motions
from fivebar_control.laws.registry import SUPERVISIONS
from fivebar_studies.sweep.drawing import Draw, draw
from fivebar_studies.sweep.planning import accepted, planned, timed_for_loads
from fivebar_studies.sweep.running import run_and_judge
from fivebar_studies.sweep.statistics import share_words

CONTROLLER, TORQUE_LIMIT = "multi_cartesian", 2.0
RIGS = ("ideal", "encoders", "calibrated")


class SupervisedRun(NamedTuple):
    """A run of a crossing.

    Attributes:
        rig, supervision: whose robot, and how the laws were blended.
        success: by the rule of the sweeps.
        error: largest (m).
        torque: largest request (Nm).
    """

    rig: str
    supervision: str
    success: bool
    error: float
    torque: float


def timed_crossings(seed: int, rig: str) -> Iterator[Draw]:
    """Yield the crossings of a rig that the planner and the controller's screen accept, as timed for its loads."""
    return accepted(lambda number: timed_for_loads(draw(seed, number, rig)), CONTROLLER)


def supervised_run(case: Draw, supervision: str) -> SupervisedRun:
    """Run an accepted crossing under one of `SUPERVISIONS`."""
    given = case.scenario(CONTROLLER)
    scenario = given.model_copy(update={"zone": given.zone._replace(supervision=supervision)})
    outcome, missed = run_and_judge(scenario, planned(case))
    requested = max(outcome.requested1, outcome.requested2)
    return SupervisedRun(case.rig, supervision, not missed, outcome.error_peak, requested)


def table(runs: Sequence[SupervisedRun]) -> str:
    """Return what the runs come to, in Markdown."""
    lines = [
        "| rig | supervision | success (95 %) | error, median and 95 % | asked for more than 2 Nm |",
        "|---|---|---|---|---|",
    ]
    for rig in dict.fromkeys(run.rig for run in runs):
        for supervision in SUPERVISIONS:
            found = [run for run in runs if (run.rig, run.supervision) == (rig, supervision)]
            good = share_words(sum(run.success for run in found), len(found))
            median, most = (1e3 * np.percentile([run.error for run in found], (50.0, 95.0))).tolist()
            over = sum(run.torque > TORQUE_LIMIT for run in found)
            lines.append(f"| `{rig}` | `{supervision}` | {good} | {median:.2f}, {most:.2f} mm | {over} |")
    return "\n".join(lines)


def main() -> None:
    """Run so many crossings of each rig."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--crossings", type=int, default=60)
    parser.add_argument("--rigs", nargs="+", default=RIGS)
    parser.add_argument("--seed", type=int, default=31331)
    given = parser.parse_args()
    expect_many_motions()
    cases = [case for rig in given.rigs for case in islice(timed_crossings(given.seed, rig), given.crossings)]
    print(table([supervised_run(case, supervision) for case in cases for supervision in SUPERVISIONS]))


if __name__ == "__main__":
    main()
