# SPDX-License-Identifier: Apache-2.0
"""The gain by crossing the Type 2 locus: area, pairs of places, cycle time and energy, with crossings and without."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fivebar_bringup.motions.request import within_drives
from fivebar_bringup.pages.content import Cell, Table
from fivebar_bringup.pages.rendering import study_page
from fivebar_control.laws.registry import CONTROLLERS, TunedController, default_tuning
from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.limits import MotionLimits, motion_limits_of
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.postures import mode_name
from fivebar_control.planning.reference_scan import ReferenceTorque
from fivebar_control.planning.roadmap import SPACING, roadmap
from fivebar_control.planning.timing import Speed
from fivebar_control.planning.transfer import Transfer, TransferRefused, plan_transfer
from fivebar_control.trajectory.desired import desired_at
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import read_robot
from fivebar_studies.engine.program import program_digest
from fivebar_studies.engine.study import Study, StudyReport, StudySettings
from fivebar_studies.engine.table import RowTable

RATE_HZ = 500
MODES: tuple[tuple[int, int], ...] = ((1, 1), (1, -1), (-1, 1), (-1, -1))
SAME = 1e-6
"""Distance (m) by which the same place on two grids may differ."""


class Reach(NamedTuple):
    """The reach of a working mode: area (cm^2) of all rests, of the largest part, and of all pairs the share joined."""

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
    return Reach(float(cell * sizes.sum()), float(cell * sizes.max()), float(((sizes / sizes.sum()) ** 2).sum()))


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
            made = plan_transfer(Task(robot, mode, RATE_HZ, follower, limits), start, goal, duration=Speed.FASTEST)
        except (TransferRefused, PlanRefused):
            continue
        found.append(Trip(sum(made.durations), work(robot, made, follower, limits), len(made.crossings)))
    return found


class GainSettings(StudySettings):
    """The settings that determine the rows of the study.

    Attributes:
        robots: by the names of their files.
        pairs: of places, for each robot.
        seed: of the pairs.
    """

    robots: tuple[str, ...] = ("dextar", "motkin")
    pairs: int = 200
    seed: int = 7177


MODE, ROBOT, PAIR = "working mode", "all working modes", "pair"
"""Kinds of rows."""


class GainRow(NamedTuple):
    """A line of crossing_gain.csv: what a working mode or a robot reaches, or the motions between a pair of places.

    Attributes:
        case: number.
        robot: by the name of its file.
        kind: "working mode", "all working modes" or "pair".
        mode: the working mode.
        area: of all rests (cm^2).
        largest: area of the largest part that is joined without crossing (cm^2).
        joined: share of all pairs of rests that a motion without crossing joins; with crossing it is `joined_across`.
        joined_across: the same of motions that may cross.
        time_without, time_with: quickest motion of a pair with no crossing, and of all motions (s).
        work_without, work_with: positive work of the motors in these (J).
    """

    case: int
    robot: str
    kind: str
    mode: str = ""
    area: float | None = None
    largest: float | None = None
    joined: float | None = None
    joined_across: float | None = None
    time_without: float | None = None
    time_with: float | None = None
    work_without: float | None = None
    work_with: float | None = None


def cases_of_robot(settings: GainSettings) -> int:
    """Return how many cases a robot has: its working modes, all of them together, and the pairs."""
    return len(MODES) + 1 + settings.pairs


def run_numbered(settings: GainSettings, number: int) -> list[GainRow]:
    """Return the row of a case."""
    index, within = divmod(number, cases_of_robot(settings))
    robot = settings.robots[index]
    if within < len(MODES):
        mode = MODES[within]
        apart, together = parts_of(robot, mode)
        one, across = reach(apart), reach(together)
        return [GainRow(number, robot, MODE, mode_name(mode), one.area, one.largest, one.pairs, across.pairs)]
    apart_and_together = zip(*(parts_of(robot, mode) for mode in MODES), strict=True)
    if within == len(MODES):
        joined, across_all = (joined_pairs([*parts]) for parts in apart_and_together)
        return [GainRow(number, robot, ROBOT, joined=joined, joined_across=across_all)]
    random = np.random.default_rng((settings.seed, within))
    places = places_of(robot)
    start, goal = (places[place] for place in random.choice(len(places), 2, replace=False))
    return [_pair(number, robot, trips(robot, start, goal))]


def _pair(number: int, robot: str, made: list[Trip]) -> GainRow:
    row, direct = GainRow(number, robot, PAIR), [trip for trip in made if trip.crossings == 0]
    if made:
        row = row._replace(time_with=min(made).time, work_with=min(made).energy)
    return row._replace(time_without=min(direct).time, work_without=min(direct).energy) if direct else row


Parts = list[frozenset[Point]]


@cache
def parts_of(robot: str, mode: WorkingMode) -> tuple[Parts, Parts]:
    """Return the parts of a working mode that are joined without crossing, and with."""
    file = read_robot(robot)
    limits = motion_limits_of(default_tuning(CONTROLLERS["unified"], file), *within_drives(robot, None, None))
    chart = roadmap(file.five_bar(), mode, limits.serial_margin, limits.rest, file.elbows_pass)
    return chart.regions(False), chart.regions(True)


@cache
def places_of(robot: str) -> list[Point]:
    """Return all places where a robot can rest in one working mode at least."""
    return sorted({point for mode in MODES for region in parts_of(robot, mode)[1] for point in region})


def command_of(settings: GainSettings) -> str:
    """Return the command that makes the rows."""
    quick = " --quick" if settings.pairs < GainSettings().pairs else ""
    return f"python docs/studies/make_result_pages.py --only {CROSSING_GAIN.name}{quick}"


def _entry(value: object) -> str:
    if isinstance(value, float):
        return f"{value:.3g}"
    return "" if value is None else f"{value}"


def gain_report(settings: GainSettings, rows: Sequence[GainRow]) -> StudyReport:
    """Return the page with all rows."""
    lines = tuple(tuple(Cell(_entry(value), value) for value in row) for row in rows)
    table = Table("rows", "Rows", "", tuple(CROSSING_GAIN.table.columns), lines)
    page = study_page(
        title="What crossing buys",
        setting=f"{', '.join(settings.robots)} · {settings.pairs} pairs of places each",
        command=command_of(settings),
        tables=[table],
    )
    return StudyReport(page, {}, [])


def _own_digest() -> str:
    """Return a digest of this script, which decides the rows as well."""
    return hashlib.sha256(Path(__file__).read_bytes()).hexdigest()[:8]


CROSSING_GAIN = Study(
    name="crossing_gain",
    place=f"{__name__}:CROSSING_GAIN",
    settings=GainSettings,
    table=RowTable(GainRow),
    run=run_numbered,
    cases=lambda settings: len(settings.robots) * cases_of_robot(settings),
    chunk=lambda settings: 4,
    report=gain_report,
    program=lambda settings: program_digest(("fivebar_bringup/motions/*.py",), settings.robots) + _own_digest(),
    command=command_of,
)
"""The study of reach, time and work with crossings and without."""
