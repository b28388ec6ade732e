"""What crossing the Type 2 locus buys: area, pairs of places, cycle time and energy, with crossings and without.

`python -m fivebar_bringup.studies.single.crossing_gain` prints the tables of docs/crossing_buys.md.
"""

from __future__ import annotations

import argparse
from typing import NamedTuple

import numpy as np

from fivebar_bringup.motions.request import within_drives
from fivebar_control.laws.registry import CONTROLLERS, TunedController, default_tuning
from fivebar_control.planning.limits import MotionLimits, motion_limits_of
from fivebar_control.planning.postures import mode_name
from fivebar_control.planning.reference_torque import ReferenceTorque
from fivebar_control.planning.roadmap import SPACING, roadmap
from fivebar_control.planning.sight import Point
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import Transfer, TransferRefused, plan_transfer
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import read_robot

RATE_HZ = 500
MODES: tuple[tuple[int, int], ...] = ((1, 1), (1, -1), (-1, 1), (-1, -1))
SAME = 1e-6
"""Distance (m) by which the same place on two grids may differ."""


class Reach(NamedTuple):
    """What a working mode reaches: area (cm^2) of all rests, of the largest part, and of all pairs the share joined."""

    area: float
    largest: float
    pairs: float


class Trip(NamedTuple):
    """A motion between two places: how long it takes (s), its motors' positive work (J), and its crossings."""

    time: float
    energy: float
    crossings: int


def reach(regions: list[frozenset[Point]]) -> Reach:
    """Return what the parts of a working mode come to, every pair of its rests counted."""
    sizes = np.array([len(region) for region in regions], dtype=np.float64)
    cell = 1e4 * SPACING * SPACING
    return Reach(cell * sizes.sum(), cell * sizes.max(), float(((sizes / sizes.sum()) ** 2).sum()))


def joined_pairs(parts: list[list[frozenset[Point]]]) -> float:
    """Return the share of all pairs of places that one part at least holds both of, in whichever working mode."""
    numbers: dict[tuple[int, int], int] = {}

    def number(point: Point) -> int:
        return numbers.setdefault((round(point[0] / SAME), round(point[1] / SAME)), len(numbers))

    members = [[number(point) for point in region] for regions in parts for region in regions]
    both = np.zeros((len(numbers), len(numbers)), dtype=np.bool_)
    for member in members:
        both[np.ix_(member, member)] = True
    return float(both.mean())


def work(robot: FiveBar, transfer: Transfer, follower: TunedController, limits: MotionLimits) -> float:
    """Return the positive work (J) of both motors along a reference; braking gives nothing back."""
    needed = ReferenceTorque(robot, transfer.plan, RATE_HZ, follower)
    total = 0.0
    for sample in range(transfer.plan.path.samples(RATE_HZ)):
        t = sample / RATE_HZ
        reference = desired_at(robot, transfer.plan, t, transfer.plan.path.at(t))
        torques = [max(-limits.torque, min(limits.torque, one)) for one in needed(sample, reference)]
        rates = reference.state.leg1.dq1, reference.state.leg2.dq1
        total += sum(max(0.0, torque * rate) for torque, rate in zip(torques, rates, strict=True)) / RATE_HZ
    return total


def trips(name: str, start: Point, goal: Point) -> list[Trip]:
    """Return the quickest motion between two rests in each working mode that has one."""
    file = read_robot(name)
    robot, follower = file.five_bar(), default_tuning(CONTROLLERS["unified"], file)
    limits = motion_limits_of(follower, *within_drives(name, None, None))
    found = []
    for mode in MODES:
        try:
            made = plan_transfer(robot, mode, start, goal, None, RATE_HZ, follower, limits, duration=Speed.FASTEST)
        except (TransferRefused, PlanRefused):
            continue
        found.append(Trip(sum(made.durations), work(robot, made, follower, limits), len(made.crossings)))
    return found


def report(name: str, count: int, seed: int) -> None:
    """Print what crossing buys a robot."""
    file = read_robot(name)
    limits = motion_limits_of(default_tuning(CONTROLLERS["unified"], file), *within_drives(name, None, None))
    robot = file.five_bar()
    charts = {mode: roadmap(robot, mode, limits.serial_margin, limits.rest, file.elbows_pass) for mode in MODES}
    parts = {crossing: [charts[mode].regions(crossing) for mode in MODES] for crossing in (False, True)}
    print(f"\n{name}: area in cm^2 (all rests, largest part without and with crossing), pairs without and with")
    for mode, without, across in zip(MODES, parts[False], parts[True], strict=True):
        one, other = reach(without), reach(across)
        print(
            f"{mode_name(mode)} | {one.area:.0f} | {one.largest:.0f} | {other.largest:.0f} | {one.pairs:.1%} |"
            f" {other.pairs:.1%}",
            flush=True,
        )
    print(
        f"whichever working mode | pairs {joined_pairs(parts[False]):.1%} | {joined_pairs(parts[True]):.1%}", flush=True
    )
    places = sorted({point for regions in parts[True] for region in regions for point in region})
    random = np.random.default_rng(seed)
    gains, works, only, none, used = [], [], 0, 0, 0
    for _ in range(count):
        start, goal = (places[index] for index in random.choice(len(places), 2, replace=False))
        made = trips(name, start, goal)
        direct = [trip for trip in made if trip.crossings == 0]
        if not made:
            none += 1
            continue
        best = min(made)
        if not direct:
            only += 1
            continue
        plain = min(direct)
        used += best.crossings > 0
        gains.append((plain.time, best.time))
        works.append((plain.energy, best.energy))
    print(
        f"{count} pairs: {none} in no working mode, {only} only by crossing, {len(gains)} without too; quicker: {used}"
    )
    for title, rows, unit in (("time", gains, "s"), ("work", works, "J")):
        if rows:
            middle = np.median(np.array(rows), axis=0)
            mean = np.mean(np.array(rows), axis=0)
            print(
                f"{title} in {unit}: median {middle[0]:.3f} without, {middle[1]:.3f} with; mean {mean[0]:.3f},"
                f" {mean[1]:.3f}",
                flush=True,
            )
    quicker = [(without, best) for without, best in gains if best < without]
    if quicker:
        shares = [best / without for without, best in quicker]
        print(f"where crossing is quicker: {np.median(shares):.2f} of the time (median), least {min(shares):.2f}")


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pairs", type=int, default=40, help="random pairs of places that are planned")
    parser.add_argument("--seed", type=int, default=2030)
    parser.add_argument("robots", nargs="*", default=["dextar", "motkin"], help="by name, or by path of their files")
    given = parser.parse_args()
    for name in given.robots:
        report(name, given.pairs, given.seed)


if __name__ == "__main__":
    main()
