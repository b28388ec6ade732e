# SPDX-License-Identifier: Apache-2.0
"""Maps: the loci and areas against geometry done by other means, and the command that draws them."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.map.map import make_map, read_mappable_robot
from fivebar_bringup.map.measures import measure
from fivebar_bringup.pages import style
from fivebar_control.model.geometry import direct_geometry, inverse_geometry, reach_margin
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.model.state import State
from fivebar_control.planning.postures import WORKING_MODES
from fivebar_control.workspace.fields import Fields, closure_margin, evaluate
from fivebar_control.workspace.loci import Loci, singular_loci
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import robot_path
from fivebar_description.strict_yaml import InputError

Array = NDArray[np.float64]

COARSE = 60


@pytest.fixture(scope="module")
def loci(robot: FiveBar) -> Loci:
    return singular_loci(robot)


@pytest.fixture(scope="module")
def fields(robot: FiveBar, loci: Loci) -> Fields:
    return evaluate(robot, loci, COARSE, lambda done, total: None)


def traced(loci: Loci, modes: tuple[int, int]) -> list[Array]:
    return [piece.curve.platform for piece in loci.type2 if piece.working_mode == modes]


def distance(place: tuple[float, float], lines: list[Array]) -> float:
    """Distance (m) of a place from polylines."""
    nearest = math.inf
    for line in lines:
        start, way = line[:-1], np.diff(line, axis=0)
        along = np.sum((np.array(place) - start) * way, axis=1) / np.maximum(np.sum(way * way, axis=1), 1e-300)
        feet = start + np.clip(along, 0.0, 1.0)[:, None] * way
        nearest = min(nearest, float(np.min(np.hypot(*(np.array(place) - feet).T))))
    return nearest


def elbows(robot: FiveBar, joints: Array) -> tuple[Array, Array]:
    """Both elbows [n, 2] from joints [n, 4], in numpy."""
    pairs = []
    for leg, q1 in ((robot.leg1, joints[:, 0]), (robot.leg2, joints[:, 2])):
        pairs.append(np.stack([leg.base_x + leg.proximal * np.cos(q1), leg.proximal * np.sin(q1)], axis=1))
    return pairs[0], pairs[1]


def determinant(robot: FiveBar, modes: tuple[int, int], x: float, y: float) -> float:
    return det_a(state_from_platform(robot, modes, x, y, 0.0, 0.0))


def test_the_locus_goes_through_what_is_known_of_it(dextar: FiveBar) -> None:
    lines = traced(singular_loci(dextar), (1, -1))
    assert distance((0.0, math.sqrt(0.0081 - 0.000961)), lines) < 1e-6
    # the thesis prints this posture with five decimals
    assert distance((-0.06745, 0.03989), lines) < 1e-5


def test_no_part_of_the_locus_is_missing(loci: Loci, locus_states: Callable[[int, int], list[State]]) -> None:
    """Places found by changes of sign of det A on random lines all lie on the traced curves."""
    for number, state in enumerate(locus_states(120, 5)):
        modes = ((1, 1), (1, -1), (-1, 1), (-1, -1))[number % 4]
        assert distance((state.x, state.y), traced(loci, modes)) < 2e-6


def test_type_2_postures_are_closed_and_have_aligned_distal_links(robot: FiveBar, loci: Loci) -> None:
    assert {piece.shape for piece in loci.type2} == {"stretched", "folded"}
    for piece in loci.type2:
        joints, platform = piece.curve.joints, piece.curve.platform
        elbow1, elbow2 = elbows(robot, joints)
        l_12, l_22 = robot.leg1.distal, robot.leg2.distal
        span = l_12 + l_22 if piece.shape == "stretched" else abs(l_12 - l_22)
        assert np.allclose(np.hypot(*(elbow2 - elbow1).T), span, atol=1e-12)
        assert np.allclose(np.hypot(*(platform - elbow1).T), l_12, atol=1e-12)
        assert np.allclose(np.hypot(*(platform - elbow2).T), l_22, atol=1e-12)
        theta1, theta2 = joints[:, 0] + joints[:, 1], joints[:, 2] + joints[:, 3]
        assert np.max(np.abs(np.sin(theta2 - theta1))) < 1e-9
        inside = slice(2, -2)
        for column, mode in ((1, piece.working_mode[0]), (3, piece.working_mode[1])):
            assert np.all(-np.sign(np.sin(joints[inside, column])) == mode)


def test_det_a_changes_its_sign_across_the_locus(robot: FiveBar, loci: Loci) -> None:
    checked = 0
    step = 1e-5
    for piece in loci.type2:
        points = piece.curve.platform
        for k in range(5, len(points) - 5, 20):
            x, y = points[k]
            if min(reach_margin(leg, x, y) for leg in (robot.leg1, robot.leg2)) < 1e-3:
                continue
            across = np.array([[0.0, -1.0], [1.0, 0.0]]) @ (points[k + 1] - points[k - 1])
            across *= step / np.hypot(*across)
            one = determinant(robot, piece.working_mode, x + across[0], y + across[1])
            other = determinant(robot, piece.working_mode, x - across[0], y - across[1])
            assert one * other < 0.0
            assert max(abs(one), abs(other)) < 0.01
            checked += 1
    assert checked > 50


def test_type_1_postures_have_a_leg_at_the_end_of_its_reach(robot: FiveBar, loci: Loci) -> None:
    for piece in loci.type1:
        leg = robot.leg1 if piece.leg == 1 else robot.leg2
        reach = leg.proximal + leg.distal if piece.shape == "stretched" else abs(leg.proximal - leg.distal)
        from_base = piece.curve.platform - np.array([leg.base_x, 0.0])
        assert np.allclose(np.hypot(*from_base.T), reach, atol=1e-12)
        theta1 = piece.curve.joints[:, 0] + piece.curve.joints[:, 1]
        theta2 = piece.curve.joints[:, 2] + piece.curve.joints[:, 3]
        assert np.all(np.sign(np.sin(theta2 - theta1))[2:-2] == piece.assembly)


def test_type_3_points_are_on_both_loci(robot: FiveBar, loci: Loci) -> None:
    assert len(loci.type3) == 12
    for point in loci.type3:
        q = point.joints
        assert abs(math.sin(q.q21 + q.q22 - q.q11 - q.q12)) < 1e-9
        bend = q.q12 if point.leg == 1 else q.q22
        # leg 2 is straight where the bridge between base 2 and elbow 1 is: known to the root of the rounding error
        assert abs(math.sin(bend)) < 1e-7
        assert (math.cos(bend) > 0.0) == (point.shape == "stretched")
        for modes in point.working_modes:
            assert distance((point.x, point.y), traced(loci, modes)) < 1e-7


def test_type_3_points_are_where_type_1_changes_its_assembly_mode(loci: Loci) -> None:
    """The same points, found from the other locus."""
    found = []
    for before, after in zip(loci.type1, loci.type1[1:], strict=False):
        joined = np.angle(np.exp(1j * (before.curve.joints[-1] - after.curve.joints[0])))
        if before.assembly != after.assembly and np.max(np.abs(joined)) < 1e-6:
            found.append(np.exp(1j * before.curve.joints[-1]))
    assert len(found) == len(loci.type3)
    for point in loci.type3:
        apart = [float(np.max(np.abs(np.exp(1j * np.array(point.joints)) - there))) for there in found]
        assert min(apart) < 1e-6


def test_workspace_area_is_that_of_two_discs(dextar: FiveBar) -> None:
    """Two discs of radius r at a distance d share 2 r^2 acos(d / 2r) - d/2 sqrt(4 r^2 - d^2).

    Equal links reach everything between stretched and folded, so that the discs have no holes.
    """
    r, d = 18.0, 11.8
    exact = 2.0 * r * r * math.acos(d / (2.0 * r)) - 0.5 * d * math.sqrt(4.0 * r * r - d * d)
    loci = singular_loci(dextar)
    measures = measure(loci, evaluate(dextar, loci, COARSE, lambda done, total: None))
    assert measures.workspace_area == pytest.approx(exact, rel=1e-3)
    for mode in measures.modes:
        assert mode.area_positive + mode.area_negative == pytest.approx(exact, rel=1e-3)


def test_workspace_with_holes_loses_their_area(robot: FiveBar, fields: Fields, loci: Loci) -> None:
    """By random sampling: 40 000 places in the grid's rectangle."""
    grid = fields.platform_grid
    random = np.random.default_rng(3)
    x, y = random.uniform(grid.x[0], grid.x[-1], 40_000), random.uniform(grid.y[0], grid.y[-1], 40_000)
    inside = np.ones(x.shape, dtype=bool)
    for leg in (robot.leg1, robot.leg2):
        apart = np.hypot(x - leg.base_x, y)
        inside &= (apart < leg.proximal + leg.distal) & (apart > abs(leg.proximal - leg.distal))
    rectangle = 1e4 * (grid.x[-1] - grid.x[0]) * (grid.y[-1] - grid.y[0])
    assert measure(loci, fields).workspace_area == pytest.approx(rectangle * float(np.mean(inside)), rel=0.015)


def test_dextar_is_symmetric(dextar: FiveBar) -> None:
    """Mirrored at x = 0 the legs change places and the elbows sides: (m1, m2) becomes (-m2, -m1); det A stays."""
    loci = singular_loci(dextar)
    fields = evaluate(dextar, loci, COARSE, lambda done, total: None)
    measures = {mode.working_mode: mode for mode in measure(loci, fields).modes}
    for modes in WORKING_MODES:
        mirrored = (-modes[1], -modes[0])
        field, other = fields.platform[modes], fields.platform[mirrored]
        assert np.allclose(field.det_a, other.det_a[:, ::-1], atol=1e-9, equal_nan=True)
        assert np.allclose(field.kappa, other.kappa[:, ::-1], atol=1e-9, equal_nan=True)
        assert measures[modes].length_stretched == pytest.approx(measures[mirrored].length_stretched, rel=1e-6)
        assert measures[modes].length_folded == pytest.approx(measures[mirrored].length_folded, rel=1e-6)
        there = traced(loci, mirrored)
        for line in traced(loci, modes):
            assert max(distance((-float(x), float(y)), there) for x, y in line[::25]) < 2e-6


def test_field_is_the_inverse_condition_number(robot: FiveBar, fields: Fields) -> None:
    """Against LAPACK's singular values of a matrix of unit vectors from the elbows."""
    grid = fields.platform_grid
    for modes, field in fields.platform.items():
        for row, column in np.argwhere(grid.reach > 0.0)[::97]:
            place = np.array([grid.x[column], grid.y[row]])
            q = np.array([inverse_geometry(robot, modes, *place.tolist())])
            rows = [(place - elbow[0]) / np.hypot(*(place - elbow[0])) for elbow in elbows(robot, q)]
            assert field.kappa[row, column] == pytest.approx(1.0 / np.linalg.cond(np.array(rows)), abs=1e-9)
            assert field.det_a[row, column] == pytest.approx(np.linalg.det(np.array(rows)), abs=1e-9)


def test_loop_closes_where_the_field_says(robot: FiveBar, fields: Fields) -> None:
    q = fields.motor_grid.q
    q11, q21 = np.meshgrid(q, q)
    joints = np.stack([q11.ravel(), 0.0 * q11.ravel(), q21.ravel(), 0.0 * q21.ravel()], axis=1)
    elbow1, elbow2 = elbows(robot, joints)
    apart = np.hypot(*(elbow2 - elbow1).T).reshape(q11.shape)
    l_12, l_22 = robot.leg1.distal, robot.leg2.distal
    closes = (apart < l_12 + l_22) & (apart > abs(l_12 - l_22))
    assert np.array_equal(fields.motor_grid.closure > 0.0, closes)
    for field in fields.motors.values():
        assert np.array_equal(np.isfinite(field.kappa), closes)
        assert np.array_equal(np.isfinite(field.working_mode), closes)


@pytest.mark.parametrize("assembly", [1, -1])
def test_loop_opens_where_the_distal_links_are_stretched_or_folded(robot: FiveBar, assembly: int) -> None:
    """Bisect along q21 for the last angle at which the direct geometry has a solution."""
    edges = 0
    for q11 in np.linspace(-3.0, 3.0, 13).tolist():
        marks = np.linspace(-math.pi, math.pi, 40).tolist()
        closed = [math.isfinite(direct_geometry(robot, assembly, q11, q21)[0]) for q21 in marks]
        for k in range(len(marks) - 1):
            if closed[k] == closed[k + 1]:
                continue
            inside, outside = (marks[k], marks[k + 1]) if closed[k] else (marks[k + 1], marks[k])
            for _ in range(60):
                middle = 0.5 * (inside + outside)
                if math.isfinite(direct_geometry(robot, assembly, q11, middle)[0]):
                    inside = middle
                else:
                    outside = middle
            place = np.array(direct_geometry(robot, assembly, q11, inside))
            elbow1, elbow2 = (elbow[0] for elbow in elbows(robot, np.array([[q11, 0.0, inside, 0.0]])))
            cosine = (place - elbow1) @ (place - elbow2) / robot.leg1.distal / robot.leg2.distal
            assert abs(abs(cosine) - 1.0) < 1e-9
            assert abs(closure_margin(robot, q11, inside)) < 1e-9
            edges += 1
    assert edges > 10


def test_type_2_is_the_rim_of_the_area_where_the_loop_closes(robot: FiveBar, loci: Loci) -> None:
    for piece in loci.type2:
        for q11, _, q21, _ in piece.curve.joints[::31].tolist():
            assert abs(closure_margin(robot, q11, q21)) < 1e-12


def run(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> tuple[int, str, str]:
    monkeypatch.setattr("fivebar_bringup.map.map.make_map", partial(make_map, cells=24))
    monkeypatch.setattr(style, "DPI", 30)
    result = CliRunner().invoke(app, ["map", *arguments])
    return result.exit_code, result.stdout, result.stderr


@pytest.mark.extra
def test_command_writes_page_figures_and_measures(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    out = tmp_path / "made" / "map"
    status, printed, _ = run(monkeypatch, "unequal", "--out", str(out), "--json")
    assert status == 0
    content = json.loads(printed)
    assert content == json.loads((out / "map.json").read_text(encoding="utf-8"))
    assert content["robot"] == "unequal"
    assert [tuple(mode["working_mode"]) for mode in content["working_modes"]] == list(WORKING_MODES)
    assert len(content["type3_points"]) == 12
    figures = sorted((out / "figures").glob("*.png"))
    assert len(figures) == 5
    assert all(figure.read_bytes().startswith(b"\x89PNG") for figure in figures)
    page = (out / "map.html").read_text(encoding="utf-8")
    assert page.count('src="data:image/png;base64,') == 5
    assert not re.search(r"https?://|<script|<link", page)


def edited(tmp_path: Path, **lengths: float) -> Path:
    """Return dextar's file with other lengths (m)."""
    text = robot_path("dextar").read_text(encoding="utf-8")
    for name, value in lengths.items():
        text = re.sub(rf"^  {name}: \S+", f"  {name}: {value}", text, flags=re.MULTILINE)
    path = tmp_path / "edited.yaml"
    path.write_text(text, encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("lengths", "complaint"),
    [
        ({"a": 0.36}, "expected less than 0.36"),
        ({"l_21": 0.5}, "the legs never meet: leg 1 stays within 0.298 m of motor 2"),
        ({"l_12": 0.5}, "the legs never meet: leg 2 stays within 0.298 m of motor 1"),
        ({"l_12": -0.1}, "l_12"),
    ],
)
def test_robots_that_cannot_be_are_refused(tmp_path: Path, lengths: dict[str, float], complaint: str) -> None:
    with pytest.raises(InputError, match=re.escape(complaint)):
        read_mappable_robot(str(edited(tmp_path, **lengths)))


@pytest.mark.parametrize("robot", ["nope", "nope.yaml"])
def test_unknown_robot_is_one_line_and_status_2(monkeypatch: pytest.MonkeyPatch, tmp_path: Path, robot: str) -> None:
    status, printed, complaint = run(monkeypatch, robot, "--out", str(tmp_path / "map"))
    assert (status, printed) == (2, "")
    assert complaint.startswith("fivebar: ")
    assert robot in complaint
    assert complaint.count("\n") == 1
    assert not (tmp_path / "map").exists()


def test_directory_that_holds_something_is_refused(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    (tmp_path / "kept").write_text("mine", encoding="utf-8")
    status, printed, complaint = run(monkeypatch, "dextar", "--out", str(tmp_path))
    assert (status, printed) == (2, "")
    assert "is not empty" in complaint
    assert complaint.count("\n") == 1
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]


@pytest.mark.parametrize(
    "lengths",
    [
        {"a": 0.18},  # the linkage of the folded locus degenerates: both elbows meet in one point only
        {"a": 0.2, "l_11": 0.1, "l_12": 0.1, "l_21": 0.1, "l_22": 0.1},
        {"l_12": 0.3, "l_22": 0.3, "l_11": 0.05, "l_21": 0.05},  # no distal links stretched
        {"a": 0.05, "l_11": 0.15, "l_12": 0.2, "l_21": 0.1, "l_22": 0.2},
    ],
)
def test_special_proportions_can_be_mapped(tmp_path: Path, lengths: dict[str, float]) -> None:
    robot = read_mappable_robot(str(edited(tmp_path, **lengths))).five_bar()
    loci = singular_loci(robot, samples=180)
    for piece in loci.type2:
        joints = piece.curve.joints
        assert np.all(np.isfinite(joints))
        assert np.max(np.abs(np.sin(joints[:, 0] + joints[:, 1] - joints[:, 2] - joints[:, 3]))) < 1e-9
    measures = measure(loci, evaluate(robot, loci, 24, lambda done, total: None))
    assert measures.workspace_area > 0.0
