# SPDX-License-Identifier: Apache-2.0
"""Trajectories in CSV files: which columns are read, how they are followed, and refusals that name the row."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

from fivebar_control.laws.registry import CONTROLLERS, default_tuning
from fivebar_control.model.kinematics import state_from_platform
from fivebar_control.planning.orders import TimedPoint
from fivebar_control.planning.pacing import Task
from fivebar_control.planning.point_planning import plan_points
from fivebar_control.planning.timed_points import MOST_POINTS
from fivebar_control.planning.trajectory_file import (
    FollowedFile,
    TrajectoryFile,
    plan_file,
    points_in,
    request_of,
)
from fivebar_control.trajectory.path import Path as PlannedPath
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_description.errors import InputError
from fivebar_description.parameters import FiveBar

MODE, TOP, BOTTOM = (1, -1), (0.0, 0.15), (0.0, 0.02)


def file_of(folder: Path, *lines: str) -> TrajectoryFile:
    path = folder / "figure.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    return TrajectoryFile.at(str(path))


def there_and_back(*, rows: int, crossing: float, rest: float = 0.0) -> list[str]:
    """Return rows from the top through the locus to the bottom and back, each way in `crossing` s with a rest on it."""
    way = PlannedPath.through([TOP, BOTTOM], [crossing])
    step = 2.0 * (crossing + rest) / (rows - 1)
    lines = ["time_s,q1_rad,q2_rad,x_m,y_m"]
    for row in range(rows):
        t = row * step
        since = min(t, 2.0 * (crossing + rest) - t)
        late = max(0.0, min(since - 0.5 * crossing, rest))
        at = way.at(since - late)
        lines.append(f"{t!r},9,9,{at.x!r},{at.y!r}")
    return lines


def refusal(robot: FiveBar, file: TrajectoryFile) -> str:
    follower = default_tuning(CONTROLLERS["unified"])
    with pytest.raises(PlanRefused) as refused:
        plan_points(Task(robot, MODE, 500, follower), request_of(robot, FollowedFile(file, TOP, MODE)))
    return str(refused.value)


def test_a_file_of_both_is_followed_by_the_platform(tmp_path: Path) -> None:
    points = points_in(file_of(tmp_path, "time_s,q1_rad,q2_rad,x_m,y_m", "0,1,2,0.0,0.15", "0.5,3,4,0.01,0.14"))
    assert points.joints == ("x", "y")
    assert points.points == (TimedPoint(0.0, (0.0, 0.15), (), ()), TimedPoint(0.5, (0.01, 0.14), (), ()))
    assert points.start() == (0.0, 0.15)


def test_short_names_velocities_and_motors_are_read(tmp_path: Path) -> None:
    header = " t , y , x ,vx_m_s,vy_m_s,ax_m_s2,ay_m_s2"
    rates = points_in(file_of(tmp_path, header, "0,0.15,0,0,0,0,0", "1,0.14,0.01,0.1,0.2,3,4"))
    assert rates.points[1] == TimedPoint(1.0, (0.01, 0.14), (0.1, 0.2), (3.0, 4.0))
    motors = points_in(file_of(tmp_path, "time_s,q2_rad,q1_rad", "0.0,2,1", "0.5,2.5,1.5"))
    assert (motors.joints, motors.points[1].position) == (("q11", "q21"), (1.5, 2.5))
    assert motors.start() is None


@pytest.mark.parametrize(
    ("lines", "reason"),
    [
        (["a,b", "1,2"], "row 1: columns a, b: expected time_s or t, and x_m and y_m"),
        (["t,x", "1,2"], "row 1: columns t, x: expected"),
        (["t,x,y,ax_m_s2,ay_m_s2", "0,0,0.15,1,1"], "row 1: columns ax_m_s2, ay_m_s2: expected only beside"),
        (["t,x,y", "0,0,0.15", "0.1,0,north"], "row 3: y 'north': expected a finite number"),
        (["t,x,y", "0,0,0.15", "0.1,0"], "row 3: y '': expected a finite number"),
        (["t,x,y", "0,0,0.15", "0.1,nan,0.15"], "row 3: x 'nan': expected a finite number"),
        (["t,x,y", "0,0,0.15", "", "0.1,0,0.15"], "row 3: is empty"),
        (["t,x,y", "0,0,0.15", "0.1,0,0.15", "0.1,0,0.15"], "row 4: time: 0.1 s after 0.1 s"),
        (["t,x,y", "0,0,0.15", "0.1,0,1e7"], "row 3: positions [0, 1e+07]: expected 2 finite numbers"),
        (["t,x,y"], f"0 points: expected 1 to {MOST_POINTS}"),
        (["t,x,y", "-1,0,0.15", "0.1,0,0.14"], "time: -1 to 0.1 s: expected times from 0"),
    ],
)
def test_what_is_no_trajectory_is_refused_with_its_row(tmp_path: Path, lines: list[str], reason: str) -> None:
    with pytest.raises(InputError) as refused:
        points_in(file_of(tmp_path, *lines))
    assert str(refused.value).startswith(str(tmp_path / "figure.csv"))
    assert reason in str(refused.value)


def test_a_file_that_is_none_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"expected the path of a \.csv file"):
        TrajectoryFile.at("figure.txt")
    with pytest.raises(InputError, match=r"missing\.csv: cannot be read"):
        TrajectoryFile.at(str(tmp_path / "missing.csv"))


def test_more_rows_than_there_may_be_are_refused(tmp_path: Path) -> None:
    rows = (f"{0.01 * number},0,0.15" for number in range(MOST_POINTS + 1))
    with pytest.raises(InputError, match=f"more than {MOST_POINTS} rows"):
        points_in(file_of(tmp_path, "t,x,y", *rows))


def test_ten_thousand_rows_cross_twice_and_are_met_at_their_times(tmp_path: Path, dextar: FiveBar) -> None:
    lines = there_and_back(rows=10_001, crossing=5.5)
    plan = plan_file(dextar, FollowedFile(file_of(tmp_path, *lines), TOP, MODE), 100)
    middle = 0.5 * 5.5
    expected = [crossing.time for crossing in plan.crossings]
    assert len(expected) == 2
    assert expected == pytest.approx([expected[0], 11.0 - expected[0]], abs=1e-6)
    assert abs(expected[0] - middle) < 0.1
    for line in lines[1::997]:
        t, _, _, x, y = map(float, line.split(","))
        assert plan.path.at(t)[:2] == pytest.approx((x, y), abs=1e-12)


def test_a_rest_on_the_locus_is_refused_with_its_row(tmp_path: Path, dextar: FiveBar) -> None:
    """Rows at 100 Hz that stop half way: where, about the middle of the first half, the platform is near the locus."""
    way = PlannedPath.through([TOP, BOTTOM], [1.0])
    at_rest = next(t for t in (n / 1000 for n in range(1000)) if way.at(t).y < 0.0845)
    lines = ["t,x,y"]
    for row in range(301):
        t = row / 100
        lines.append(f"{t},0,{way.at(min(t, max(at_rest, t - 2.0))).y!r}")
    text = refusal(dextar, file_of(tmp_path, *lines))
    assert "near the Type 2 locus" in text
    row = int(text.split("after row ")[1].split(";")[0].split(" ")[0])
    # row 1 has the names
    assert at_rest - 0.1 <= (row - 2) / 100 <= at_rest + 2.1


def test_a_place_out_of_reach_is_refused_with_its_row(tmp_path: Path, dextar: FiveBar) -> None:
    lines = ["t,x,y", "0,0,0.15", "1,0,0.15", "2,0,0.9"]
    assert "after row 3, the platform is out of reach" in refusal(dextar, file_of(tmp_path, *lines))


def test_rows_after_time_0_begin_where_the_robot_rests(tmp_path: Path, dextar: FiveBar) -> None:
    request = request_of(dextar, FollowedFile(file_of(tmp_path, "t,x,y", "1,0,0.14", "2,0,0.13"), TOP, MODE))
    assert request.points[0].position == TOP
    assert [request.label_at(t) for t in (0.5, 1.0, 1.5, 2.0)] == ["row 2", "row 2", "row 2", "row 3"]


def test_motors_are_followed_by_the_motors(tmp_path: Path, dextar: FiveBar) -> None:
    begin, end = (state_from_platform(dextar, MODE, 0.0, y, 0.0, 0.0) for y in (0.15, 0.14))
    rows = [f"{t},{state.leg1.q1!r},{state.leg2.q1!r}" for t, state in ((0, begin), (1, end))]
    plan = plan_file(dextar, FollowedFile(file_of(tmp_path, "t,q11,q21", *rows), TOP, MODE), 100)
    there = plan.path.at(1.0)
    assert math.hypot(there.x, there.y - 0.14) < 1e-9
