# SPDX-License-Identifier: Apache-2.0
"""Trajectories in CSV files: a time in each row, and where the platform or the motors are then.

The first row names the columns; rows are counted as a spreadsheet counts them. A file with columns of the platform and
of the motors is followed by the platform's, since motor angles do not fix the platform near the Type 2 locus.
"""

from __future__ import annotations

import csv
import io
import math
import os
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from fivebar_control.model.state import WorkingMode
from fivebar_control.planning.limits import MotionLimits
from fivebar_control.planning.line_of_sight import Point
from fivebar_control.planning.orders import IN_FILE, TimedPoint, TrajectoryRequest
from fivebar_control.planning.point_planning import plan_knots
from fivebar_control.planning.timed_points import MOST_POINTS, TimedPoints, read_points, request_from
from fivebar_control.trajectory.planner import Plan
from fivebar_description.errors import InputError, quoted
from fivebar_description.files import LARGEST_TABLE, read_text
from fivebar_description.interface import ACTIVE_JOINTS, PLATFORM_NAMES
from fivebar_description.outside_text import one_line
from fivebar_description.parameters import FiveBar

SUFFIX = ".csv"

TIMES = ("time_s", "t", "time")
COORDINATES = (
    (PLATFORM_NAMES, (("x_m", "y_m"), ("x", "y"))),
    (ACTIVE_JOINTS, (("q1_rad", "q2_rad"), ("q11_rad", "q21_rad"), ("q11", "q21"))),
)
"""Names of columns: of the time, and of both coordinates, those of the platform first."""

RATES = {
    PLATFORM_NAMES: (("vx_m_s", "vy_m_s"), ("ax_m_s2", "ay_m_s2")),
    ACTIVE_JOINTS: (("dq1_rad_s", "dq2_rad_s"), ("ddq1_rad_s2", "ddq2_rad_s2")),
}
"""Names of columns that a file may have besides: first and second derivatives. Further columns are not read."""

LEAST_KAPPA = MotionLimits().rest
"""1/cond(A) below which motor angles do not fix the platform well enough."""


class TrajectoryFile(NamedTuple):
    """A file as it is at a moment: its path, when it was last changed (ns), and its size (bytes)."""

    path: str
    changed_ns: int
    size: int

    @classmethod
    def at(cls, path: str) -> TrajectoryFile:
        """Return the file of a path.

        Raises:
            InputError: there is none.
        """
        if not path.endswith(SUFFIX):
            raise InputError(f"{path}: expected the path of a {SUFFIX} file")
        try:
            status = os.stat(path)
        except (OSError, ValueError) as error:
            raise InputError(f"{path}: cannot be read: {getattr(error, 'strerror', None) or error}") from error
        return cls(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=4)
def points_in(file: TrajectoryFile) -> TimedPoints:
    """Return the points of a file.

    Raises:
        InputError: it is no such file; the message names the row.
    """
    try:
        return _points_of(read_text(Path(file.path), LARGEST_TABLE))
    except InputError as error:
        known = str(error).startswith(file.path)
        raise error if known else InputError(f"{file.path}: {error}") from error


def _points_of(text: str) -> TimedPoints:
    rows = csv.reader(io.StringIO(text))
    try:
        names = [name.strip() for name in next(rows, [])]
        time = next((name for name in TIMES if name in names), None)
        joints, columns = next(
            ((joints, pair) for joints, pairs in COORDINATES for pair in pairs if set(pair) <= set(names)), (None, ())
        )
        if time is None or joints is None:
            shown = one_line(", ".join(names), 60)
            raise InputError(
                f"row 1: columns {shown}: expected time_s or t, and x_m and y_m, x and y, or q1_rad and q2_rad"
            )
        besides = [pair for pair in RATES[joints] if set(pair) <= set(names)]
        if besides and besides[0] != RATES[joints][0]:
            raise InputError(f"row 1: columns {', '.join(besides[0])}: expected only beside those of the velocities")
        wanted = [names.index(name) for name in (time, *columns, *(name for pair in besides for name in pair))]
        points: list[TimedPoint] = []
        for number, row in enumerate(rows, start=2):
            if not row:
                # at the end of a file, or to be missed by the row after it
                continue
            if number > len(points) + 2:
                raise InputError(f"row {len(points) + 2}: is empty: expected a row of numbers")
            if number > MOST_POINTS + 1:
                raise InputError(f"more than {MOST_POINTS} rows: expected at most so many")
            values = [_number(row, index, number, names) for index in wanted]
            points.append(TimedPoint(values[0], values[1:3], values[3:5], values[5:7]))
    except csv.Error as error:
        raise InputError(f"row {rows.line_num}: is not CSV: {error}") from error
    return read_points(joints, points, IN_FILE)


def _number(row: list[str], index: int, number: int, names: list[str]) -> float:
    text = row[index] if index < len(row) else ""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not math.isfinite(value):
        raise InputError(f"row {number}: {names[index]} {quoted(text.strip())}: expected a finite number")
    return value


class FollowedFile(NamedTuple):
    """A file that is followed.

    Attributes:
        file: as it is.
        place: where the platform rests at the beginning (m).
        working_mode: of the whole motion.
        payload: what the platform carries (kg).
    """

    file: TrajectoryFile
    place: Point
    working_mode: WorkingMode
    payload: float = 0.0


@lru_cache(maxsize=4)
def request_of(robot: FiveBar, followed: FollowedFile) -> TrajectoryRequest:
    """Return the request to the planner for a file.

    Raises:
        InputError: it is no such file, or does not begin where the robot rests.
    """
    points = points_in(followed.file)
    unknown = (math.nan, math.nan)
    try:
        return request_from(robot, points, followed.place, followed.working_mode, unknown, followed.payload)
    except InputError as error:
        raise InputError(f"{followed.file.path}: {error}") from error


@lru_cache(maxsize=4)
def plan_file(robot: FiveBar, followed: FollowedFile, rate_hz: int) -> Plan:
    """Return the plan of a motion along a file, which is not judged.

    Raises:
        InputError: it is no such file, or does not begin where the robot rests.
        PlanRefused: it has no reference everywhere.
    """
    return plan_knots(robot, request_of(robot, followed), rate_hz, LEAST_KAPPA)
