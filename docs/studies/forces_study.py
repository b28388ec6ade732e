# SPDX-License-Identifier: Apache-2.0
"""Crossings of a vertical robot, downwards, upwards and sideways, beside the same crossings of a level one.

`python docs/studies/forces_study.py [--crossings 60] [--rigs RIG ...] [--torque 4] [--seed N]` draws
crossings of a rig with one crossing of the locus that the level robot makes in the drawn duration. Then the robot is
vertical, with gravity along the path, against it and across it. It prints the figures of docs/motions.md:
how many have a motion for which the torque is enough, how many of these succeed, and the largest distance from the
reference of both in the same duration.
"""

from __future__ import annotations

import argparse
import math
import tempfile
from collections.abc import Iterator, Sequence
from itertools import count, islice
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fivebar_control.compiling import expect_many_motions
from fivebar_control.planning.reference_scan import full_torque
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import Plan
from fivebar_control.trajectory.time_laws import CRITERION
from fivebar_description.loads import Forces
from fivebar_description.robot_file import read_robot
from fivebar_description.strict_yaml import InputError, yaml_text
from fivebar_studies.sweep.drawing import PLANNED_FOR, Draw, DrawnScenario, draw
from fivebar_studies.sweep.running import run_and_judge
from fivebar_studies.sweep.statistics import share_words

RIGS = ("ideal", "calibrated", "good")

DIRECTIONS = {"down": 0.0, "up": math.pi, "sideways": math.pi / 2.0}
"""Direction of gravity, from the direction of the path."""

MOMENT = 0.02
"""First mass moment (kg m) of each leg of DexTAR: its zz_i1R as if of a bar and a mass at the elbow, without rotor."""

NEAR_LOCUS = 0.05
"""Below this 1/cond(A) the torque of a reference is not looked at: on the locus there is none."""


class ForcedRun(NamedTuple):
    """A crossing with gravity in a direction.

    Attributes:
        rig, direction: whose robot, and of what gravity.
        torque: largest of the reference (Nm), infinite where there is no motion.
        success: by the rule of the sweeps, of a motion for which the torque is enough.
        error, level: largest of the vertical robot and of the level one (m).
    """

    rig: str
    direction: str
    torque: float
    success: bool
    error: float
    level: float


def vertical_file(robot: str, downhill: float, folder: Path) -> str:
    """Write the file of a vertical robot, with gravity in a direction (rad), and return its path."""
    file = read_robot(robot)
    moment = MOMENT if file.proximal_links is None else None
    forces = Forces(math.pi / 2.0, math.remainder(downhill, 2.0 * math.pi), moment, moment)
    path = folder / f"{robot}_{downhill:.6f}.yaml"
    content = file.model_copy(update={"forces": forces}).model_dump(mode="json", exclude_none=True)
    path.write_text(yaml_text(content), encoding="utf-8")
    return str(path)


def crossings(seed: int, rig: str, torque: float) -> Iterator[tuple[Draw, DrawnScenario, float]]:
    """Yield crossings of a rig that the level robot makes within a torque (Nm), with its error (m)."""
    for number in count():
        case = draw(seed, number, rig)
        try:
            scenario = with_torque(case.scenario(PLANNED_FOR), torque)
            plan = scenario.plan()
        except InputError:
            continue
        if len(plan.crossings) != 1 or reference_torque(scenario, plan) > torque:
            continue
        outcome, missed = run_and_judge(scenario, plan)
        if not missed:
            yield case, scenario, outcome.error_peak


def with_torque(scenario: DrawnScenario, torque: float) -> DrawnScenario:
    """Return a scenario whose motion meets the criterion, on drives of a torque (Nm)."""
    return scenario.model_copy(
        update={"time_law": CRITERION, "plant": scenario.plant._replace(torque_limit=torque), "force": True}
    )


def reference_torque(scenario: DrawnScenario, plan: Plan) -> float:
    """Return the largest torque (Nm) that the reference needs beside the locus."""
    robot, largest = scenario.five_bar(), 0.0
    for sample in range(plan.path.samples(scenario.rate_hz) + 1):
        t = sample / scenario.rate_hz
        torque = full_torque(robot, desired_at(robot, plan, t, plan.path.at(t)))
        largest = max(largest, *(abs(one) for one in torque if math.isfinite(one)))
    return largest


def forced_run(
    case: Draw, level: DrawnScenario, error: float, direction: str, torque: float, folder: Path
) -> ForcedRun:
    """Run a crossing on the vertical robot, whose level one has an error (m)."""
    path = math.atan2(case.end_y - case.start_y, case.end_x - case.start_x)
    robot = vertical_file(case.robot_name, path + DIRECTIONS[direction], folder)
    scenario = level.model_copy(update={"robot": robot})
    try:
        plan = scenario.plan()
    except InputError:
        return ForcedRun(case.rig, direction, math.inf, False, math.inf, error)
    needed = reference_torque(scenario, plan)
    if needed > torque:
        return ForcedRun(case.rig, direction, needed, False, math.inf, error)
    outcome, missed = run_and_judge(scenario, plan)
    return ForcedRun(case.rig, direction, needed, not missed, outcome.error_peak, error)


def table(runs: Sequence[ForcedRun], torque: float) -> str:
    """Return what the runs come to, in Markdown."""
    lines = [
        f"| rig | direction | torque needed, median | at most {torque:g} Nm | succeed (95 %) | error, level |"
        " error, vertical | ratio |",
        "|---|---|---|---|---|---|---|---|",
    ]
    for rig in dict.fromkeys(run.rig for run in runs):
        for direction in DIRECTIONS:
            all_of = [run for run in runs if (run.rig, run.direction) == (rig, direction)]
            strong = [run for run in all_of if run.torque <= torque]
            good = share_words(sum(run.success for run in strong), len(strong), 0)
            errors = np.array([(run.level, run.error) for run in strong if run.success]).reshape(-1, 2)
            level, vertical = (1e3 * np.median(errors, axis=0)).tolist() if len(errors) else (math.nan, math.nan)
            lines.append(
                f"| `{rig}` | {direction} | {np.median([run.torque for run in all_of]):.2f} Nm |"
                f" {len(strong)} of {len(all_of)} | {good} |"
                f" {level:.3f} mm | {vertical:.3f} mm | {vertical / level:.2f} |"
            )
    return "\n".join(lines)


def main() -> None:
    """Run so many crossings of each rig."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--crossings", type=int, default=60)
    parser.add_argument("--rigs", nargs="+", default=RIGS)
    parser.add_argument("--torque", type=float, default=4.0)
    parser.add_argument("--seed", type=int, default=90210)
    given = parser.parse_args()
    expect_many_motions()
    runs = []
    with tempfile.TemporaryDirectory() as folder:
        for rig in given.rigs:
            for case, level, error in islice(crossings(given.seed, rig, given.torque), given.crossings):
                for direction in DIRECTIONS:
                    runs.append(forced_run(case, level, error, direction, given.torque, Path(folder)))
    print(table(runs, given.torque))


if __name__ == "__main__":
    main()
