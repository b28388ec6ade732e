# SPDX-License-Identifier: Apache-2.0
"""How much faster the quickest time laws are than the fifth-order polynomial, on crossings of the benchmark.

`python docs/studies/optimal_study.py 200 OUT.csv` runs the first 200 and prints the summary of
docs/laws.md; a run that was interrupted is continued. With each time law a segment takes as long as lets its torques,
friction included, be `PLANNED` Nm at most; then `mpc` follows it with a torque limit of `LIMIT` Nm.
"""

from __future__ import annotations

import argparse
import csv
import math
from collections.abc import Sequence
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fivebar_control.laws.law import TunedLaw
from fivebar_control.laws.mpc import LAW, MpcSettings
from fivebar_control.laws.registry import CONTROLLERS, TunedController
from fivebar_control.model.dynamics import inverse_dynamics_of_platform
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.planning.predicted_run import predict_run
from fivebar_control.trajectory.planner import Plan, plan_motion
from fivebar_control.trajectory.refusal import PlanRefused
from fivebar_control.trajectory.time_laws import OPTIMAL, OPTIMAL_WITH_FRICTION, QUINTIC
from fivebar_control.trajectory.zones import ZoneRule
from fivebar_description.parameters import FiveBar, friction_torque
from fivebar_description.robot_file import load_robot
from fivebar_description.rounding import in_millimetres
from fivebar_studies.benchmark.crossings import BenchmarkCrossing, benchmark
from fivebar_studies.sweep.drawing import RATE_HZ, ROBOT

TIME_LAWS = (QUINTIC, OPTIMAL, OPTIMAL_WITH_FRICTION)

PLANNED, LIMIT = 0.85, 1.0
"""Torque of the reference, and limit of the law (Nm): the rest is for feedback."""

OFF_LOCUS = 2e-3
"""Time (s) on either side of a crossing in which the reference's torque is left out: there the
polynomial has none that is bounded."""

SHORTEST, LONGEST = 0.05, 8.0
"""Durations (s) among which the one with the planned torque is sought."""

FOLLOWED = 2e-4
"""Distance (m) from the reference within which a segment counts as followed."""


class Quickest(NamedTuple):
    """A crossing with a time law, as fast as the torque allows.

    Attributes:
        crossing: of the benchmark.
        time_law: by which.
        duration: s, NaN where there is no such motion.
        error: largest distance from the reference under `mpc` (m).
        torque: the largest that it asks for (Nm).
        mode_changes: of the assembly mode.
    """

    crossing: int
    time_law: str
    duration: float
    error: float
    torque: float
    mode_changes: int


def planned(robot: FiveBar, crossing: BenchmarkCrossing, time_law: str, duration: float) -> Plan:
    """Return the plan of a crossing.

    Raises:
        PlanRefused: there is none.
    """
    ends = (crossing.start_x, crossing.start_y), (crossing.end_x, crossing.end_y)
    return plan_motion(
        robot, (crossing.mode1, crossing.mode2), ends, [duration], RATE_HZ, ZoneRule(), time_law, min_authority=0.0
    )


def planned_torque(robot: FiveBar, plan: Plan) -> float:
    """Return the largest torque (Nm) of a plan's reference, friction included, `OFF_LOCUS` and more from the locus."""
    largest = 0.0
    for t in np.linspace(0.0, plan.path.duration, 401).tolist():
        if any(abs(t - crossing.time) < OFF_LOCUS for crossing in plan.crossings):
            continue
        x, y, vx, vy, ax, ay = plan.path.at(t)
        state = state_from_platform(robot, plan.mode, x, y, vx, vy)
        f1, f2 = friction_torque(robot.leg1, state.leg1.dq1), friction_torque(robot.leg2, state.leg2.dq1)
        torques = inverse_dynamics_of_platform(robot, state, ax, ay, f1, f2)
        largest = max(largest, *map(abs, torques))
    return largest


def quickest(robot: FiveBar, crossing: BenchmarkCrossing, time_law: str) -> Quickest:
    """Return a crossing as fast as the torque allows, followed by `mpc`."""
    short, long = SHORTEST, LONGEST
    try:
        if planned_torque(robot, planned(robot, crossing, time_law, long)) > PLANNED:
            return Quickest(crossing.crossing, time_law, math.nan, math.nan, math.nan, 0)
        while long > 1.01 * short:
            middle = math.sqrt(short * long)
            if planned_torque(robot, planned(robot, crossing, time_law, middle)) > PLANNED:
                short = middle
            else:
                long = middle
        plan = planned(robot, crossing, time_law, math.ceil(long * RATE_HZ) / RATE_HZ)
    except PlanRefused:
        return Quickest(crossing.crossing, time_law, math.nan, math.nan, math.nan, 0)
    follower = TunedController(CONTROLLERS["mpc"], TunedLaw(LAW, MpcSettings(torque_limit=LIMIT)))
    run = predict_run(robot, plan, RATE_HZ, follower, math.inf)
    return Quickest(
        crossing.crossing,
        time_law,
        plan.path.duration,
        run.error.value,
        run.torque.value,
        round(run.mode_changes.value),
    )


def summary(found: Sequence[Quickest], crossings: Sequence[BenchmarkCrossing]) -> str:
    """Return what the crossings come to, in Markdown."""
    by_law = {law: {one.crossing: one for one in found if one.time_law == law} for law in TIME_LAWS}
    feasible = [
        number
        for number in by_law[QUINTIC]
        if all(number in rows and not math.isnan(rows[number].duration) for rows in by_law.values())
    ]
    lines = [f"{len(feasible)} of {len(by_law[QUINTIC])} crossings with each time law"]
    for law in TIME_LAWS[1:]:
        ratios = np.array([by_law[QUINTIC][number].duration / by_law[law][number].duration for number in feasible])
        bounds = ", ".join(f"{value:.2f}" for value in np.percentile(ratios, (5, 50, 95)).tolist())
        lines.append(f"`{law}`, times faster, 5, 50, 95 %: {bounds}; slower on {np.sum(ratios < 1.0)}")
    lines += [
        "",
        "| | duration, median | followed within 0.2 mm and 1 Nm | error, 50, 95 % and largest | largest torque |",
        "|---|---|---|---|---|",
    ]
    for law, rows in by_law.items():
        chosen = [rows[number] for number in feasible]
        good = sum(
            one.error < FOLLOWED
            and one.torque <= LIMIT + 1e-9
            and one.mode_changes == crossings[one.crossing].mode_changes
            for one in chosen
        )
        errors = np.percentile([one.error for one in chosen], (50, 95, 100)).tolist()
        lines.append(
            f"| `{law}` | {np.median([one.duration for one in chosen]):.3f} s | {good} of {len(chosen)} | "
            + ", ".join(in_millimetres(value, 3) for value in errors)
            + f" | {max(one.torque for one in chosen):.3f} Nm |"
        )
    return "\n".join(lines)


def main() -> None:
    """Run the first so many crossings of the benchmark, with their results in a file."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("count", type=int, help="crossings")
    parser.add_argument("out", type=Path, help="file of the results, with which it goes on")
    given = parser.parse_args()
    count, out = given.count, given.out
    robot, crossings, found = load_robot(ROBOT), benchmark()[:count], list[Quickest]()
    if out.exists():
        with out.open(encoding="utf-8", newline="") as file:
            for number, law, duration, error, torque, changes in csv.reader(file):
                found.append(Quickest(int(number), law, float(duration), float(error), float(torque), int(changes)))
    done = {one[:2] for one in found}
    with out.open("a", encoding="utf-8", newline="") as file:
        for crossing in crossings:
            for law in TIME_LAWS:
                if (crossing.crossing, law) not in done:
                    found.append(quickest(robot, crossing, law))
                    csv.writer(file).writerow(found[-1])
                    file.flush()
    print(summary(found, crossings))


if __name__ == "__main__":
    main()
