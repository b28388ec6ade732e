# SPDX-License-Identifier: Apache-2.0
"""What a robot's file says of its robots, and what an assessment makes of their runs."""

from __future__ import annotations

import math
import shlex
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.odds.robot_errors import drawn_effects
from fivebar_control.model.kinematics import assembly_mode, state_from_platform
from fivebar_control.scenario.robot_defaults import derived_tuning
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_studies.assess import running
from fivebar_studies.assess.assess import ASSESSMENT, MOST_DRAWS
from fivebar_studies.assess.reach import reach_of
from fivebar_studies.assess.rows import ACCEPTED, RANDOM, REFUSED, UNLIKELY, AssessRow
from fivebar_studies.assess.running import AssessSettings, run_numbered, variants_of
from fivebar_studies.assess.statistics import (
    best_tuning,
    changes,
    expected,
    half_width,
    removed_errors,
    status_counts,
    success_of,
)
from fivebar_studies.assess.typical import typical_motions
from fivebar_studies.engine.running import run_study
from fivebar_studies.rigs.declared import (
    REMOVED,
    SENSORS,
    VARIANTS,
    assumptions,
    robots_drawn,
)
from fivebar_studies.rigs.named import find_rig
from fivebar_studies.rigs.rig import Rig

BELT = str(Path(__file__).parents[3] / "data" / "belt.yaml")


def rig_of(variant: str = "", robot: str = BELT) -> Rig:
    return find_rig(f"robot:{robot}{'#' if variant else ''}{variant}")


def test_the_rig_of_a_robot_is_what_its_file_declares() -> None:
    rig = rig_of()
    errors = rig.errors
    assert (errors.length, errors.zero, errors.tilt, errors.push) == (2e-4, 2e-3, 0.035, 1.0)
    assert rig.plant["encoder_counts"] == 98304
    assert rig.plant["transmission"] == {"frequency": 60.0, "damping": 0.04, "backlash": 1e-3}
    assert errors.rotor_share == pytest.approx((0.55, 0.85))
    assert rig.scenario["imu"]["rate_hz"] == 100 and rig.scenario["ekf"]["gyro"]
    # 2 mm of a DexTAR, whose links have 90 mm
    assert rig.scenario["error_tolerance"] == pytest.approx(2e-3 * 163.75 / 90.0, abs=1e-6)


def test_what_is_not_declared_is_assumed_and_said() -> None:
    said = {one.key for one in assumptions(read_robot("dextar"))}
    assert {"tolerances", "loads", "transmission", "drives.torque_limit", "drives.encoder_counts"} < said
    assert {one.key for one in assumptions(read_robot(BELT))}.isdisjoint({"tolerances", "loads", "transmission"})
    assert rig_of(robot="dextar").errors.length == 3e-4 and not rig_of(robot="dextar").scenario["ekf"]["gyro"]


@pytest.mark.parametrize("variant", ["lengths", "zeros", "tilt", "push", "lost_commands"])
def test_removing_an_error_leaves_all_other_random_numbers(variant: str) -> None:
    base, less = rig_of(), rig_of(variant)
    drawn, without = (drawn_effects(one.errors, 3, 7, 1.0) for one in (base, less))
    gone = {"lengths": "links", "zeros": "encoders", "lost_commands": "bus"}.get(variant, variant)
    assert gone in drawn and gone not in without
    assert {name: one for name, one in drawn.items() if name != gone} == without


@pytest.mark.parametrize("robot", ["dextar", BELT])
def test_no_variant_has_larger_errors_than_its_estimator_counts_on(robot: str) -> None:
    for variant in VARIANTS:
        rig = rig_of(variant, robot)
        for key, bound in rig.scenario["tolerances"].items():
            assert getattr(rig.errors, key, 0.0) <= bound, (variant, key)


def test_a_removed_error_is_known_to_be_gone() -> None:
    # the estimator counts on a calibrated robot, since other errors are left
    known, errors = rig_of("geometry").scenario["tolerances"], rig_of("geometry").errors
    assert (known["length"], known["zero"], errors.length, errors.zero) == (2e-5, 2e-4, 0.0, 0.0)
    assert rig_of("passive_friction").plant["friction"]["passive"] == 0.0
    assert "transmission" not in rig_of("elasticity").plant
    # the law may be quicker where nothing bends
    assert rig_of("elasticity").scenario["unified"]["kp"] > rig_of().scenario["unified"]["kp"]


def test_sensors_are_taken_away_and_added() -> None:
    used = {
        name: (
            rig.scenario["ekf"]["gyro"],
            rig.scenario["sensors"]["passive_encoder"]["leg"],
            rig.scenario["camera"]["on"],
        )
        for name in SENSORS
        for rig in (rig_of(name),)
    }
    assert used == {
        "encoders_alone": (False, 0, False),
        "gyroscope": (True, 0, False),
        "passive_encoder": (False, 2, False),
        "camera": (False, 0, True),
        "gyroscope_and_passive_encoder": (True, 2, False),
    }
    # what a robot has is no variant of it
    assert "gyroscope" not in variants_of(BELT) and "gyroscope" in variants_of("dextar")
    assert {"backlash", "elasticity", "gyro_bias"}.isdisjoint(variants_of("dextar")) and set(REMOVED) < set(VARIANTS)


@pytest.mark.parametrize(("frequency", "bandwidth"), [(40.0, 25.1), (60.0, 37.7), (100.0, 62.8), (400.0, 70.0)])
def test_the_bandwidth_is_a_tenth_of_the_lowest_frequency(frequency: float, bandwidth: float) -> None:
    file = read_robot(BELT)
    file = file.model_copy(update={"transmission": file.transmission._replace(frequency=frequency)})
    assert derived_tuning(file)["bandwidth"] == bandwidth


def test_a_sweep_draws_a_robot_as_its_file_declares() -> None:
    assert robots_drawn(BELT) == {"rig": f"robot:{BELT}"}
    assert robots_drawn("motkin") == {"robot": "motkin"}


def runs(case: int, made: str, error: float, variant: str = "", status: str = ACCEPTED) -> list[AssessRow]:
    """A row for each letter: y for a success, n for none."""
    return [
        AssessRow(
            case,
            RANDOM,
            status,
            variant=variant,
            controller="unified",
            robot=robot,
            success=letter == "y",
            error_peak=error,
        )
        for robot, letter in enumerate(made)
    ]


def test_an_interval_counts_motions_and_not_runs() -> None:
    alike = [row for case in range(10) for row in runs(case, "yyyy" if case else "nnnn", 1e-3)]
    mixed = [row for case in range(10) for row in runs(case, "yyyn" if case < 4 else "yyyy", 1e-3)]
    assert success_of(alike).share == success_of(mixed).share == 0.9
    # all robots of one motion fail: that is one failure of ten, not four of forty
    assert success_of(alike).low == pytest.approx(0.555, abs=0.01)
    assert success_of(mixed).low == pytest.approx(0.763, abs=0.01)


def test_errors_are_ranked_by_what_their_removal_brings() -> None:
    rows: list[AssessRow] = []
    for case in range(6):
        rows += runs(case, "yyyn", 2e-3, status=ACCEPTED if case < 4 else UNLIKELY)
        rows += runs(case, "yyyy", 1e-3, "tilt", status=ACCEPTED if case < 4 else UNLIKELY)
        rows += runs(case, "yyyn", 1.9e-3, "zeros", status=ACCEPTED if case < 4 else UNLIKELY)
        rows += runs(case, "yynn", 3e-3, "bandwidth_1.5", status=ACCEPTED if case < 4 else UNLIKELY)
    rows.append(AssessRow(6, RANDOM, REFUSED, "out of reach"))
    ranked = changes(rows, "unified", REMOVED)
    assert [one.variant for one in ranked] == ["tilt", "zeros"]
    # what may be chance is not shown
    assert [one.variant for one in removed_errors(rows, "unified")] == ["tilt"]
    assert (ranked[0].gain, ranked[0].spread, ranked[0].ratio) == (0.25, 0.0, 0.5) and ranked[0].sure
    assert not ranked[1].sure and best_tuning(rows, "unified") == ""
    # what is expected is that of the accepted motions alone
    (found,) = expected(rows, ("unified",))
    assert (found.success.runs, found.median) == (16, 2e-3)
    assert status_counts(rows) == {ACCEPTED: 4, UNLIKELY: 2, REFUSED: 1}


def test_the_intervals_of_a_table_hold_for_all_its_lines_at_once() -> None:
    """Student's t of 9 degrees of freedom: 2.262 for one line, 3.690 for ten (0.05 / 20 on either side)."""
    gains = [0.0, 0.1] * 5
    deviation = 0.05 * math.sqrt(10.0 / 9.0) / math.sqrt(10.0)
    assert half_width(gains, 1) == pytest.approx(2.262 * deviation, rel=1e-3)
    assert half_width(gains, 10) == pytest.approx(3.690 * deviation, rel=1e-3)


def test_a_motion_that_is_refused_is_asked_of_better_robots_until_one_is_likely(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    asked = []

    def typical_of(settings: AssessSettings, number: int, motion: object, variant: str) -> list[AssessRow]:
        asked.append(variant)
        status = ACCEPTED if variant in ("as_in_file", "geometry") else REFUSED
        return [AssessRow(number, "across", status, variant=variant)]

    monkeypatch.setattr(running, "_typical_of", typical_of)
    run_numbered(AssessSettings(robot="dextar"), 0)
    # a robot of which nothing is declared is also what its file says
    assert asked == ["as_in_file", "", "gyroscope", "geometry"]
    asked.clear()
    run_numbered(AssessSettings(robot=BELT), 0)
    assert asked == ["", "geometry"]


def test_typical_motions_have_the_command_that_makes_them() -> None:
    motion = typical_motions(BELT)[0]
    arguments = shlex.split(motion.command("my robot.yaml"))
    assert arguments[:6] == ["fivebar", "goto", "--robot", "my robot.yaml", "--mode", motion.assembly]
    assert tuple(map(float, arguments[-2:])) == motion.goal


def test_typical_motions_cross_where_their_names_say_so() -> None:
    robot, home = read_robot(BELT).five_bar(), read_robot(BELT).home_m
    here = assembly_mode(state_from_platform(robot, (1, -1), *home, 0.0, 0.0))
    for motion in typical_motions(BELT):
        there = assembly_mode(state_from_platform(robot, (1, -1), *motion.goal, 0.0, 0.0))
        assert ("across" in motion.name) == (there != here)
        assert (motion.assembly == "+") == (there > 0)
    assert len(typical_motions(BELT)) == 4


def test_the_reach_has_areas_and_room_along_the_locus() -> None:
    reach = reach_of(read_robot("dextar"))
    # `fivebar map dextar` says 600.5 cm² and 51.62 cm
    assert reach.measures.workspace_area == pytest.approx(600.5, rel=1e-3)
    assert reach.loci[0].length == pytest.approx(51.62, abs=0.01)
    assert all(0.3 < one.room < 0.9 for one in reach.loci)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        ("name: x\n", "lengths_m"),
        ("- 1\n", "expected keys with values"),
        ("", "expected keys with values"),
        (None, "cannot be read"),
        ("BELT l_11: 2.0", "the legs never meet"),
        ("BELT backlash: -1.0", "transmission.backlash"),
        ("BELT gyro_noise: cheap", "imu.gyro_noise"),
    ],
)
def test_a_bad_robot_file_is_one_line(tmp_path: Path, content: str | None, words: str) -> None:
    path = tmp_path / "robot.yaml"
    if content is not None and content.startswith("BELT "):
        key = content.removeprefix("BELT ")
        name = key.partition(":")[0]
        text = Path(BELT).read_text(encoding="utf-8")
        start = text.index(f"{name}:")
        end = min(place for place in (text.find(mark, start) for mark in ",}") if place > 0)
        content = text[:start] + key + text[end:]
    if content is not None:
        path.write_text(content, encoding="utf-8")
    done = CliRunner().invoke(app, ["assess", str(path), "--out", str(tmp_path / "out")])
    assert (done.exit_code, done.stderr.count("\n")) == (2, 1), done.stderr
    assert words in done.stderr and not (tmp_path / "out").exists()


@pytest.mark.extra
@pytest.mark.timeout(1800)  # the compilation alone takes minutes on a busy machine
def test_an_assessment_is_resumed_and_says_what_the_robot_can_do(tmp_path: Path) -> None:
    given: dict[str, Any] = {"robot": BELT, "cases": 2, "robots": 2}
    made = run_study(ASSESSMENT, given, tmp_path / "out")
    rows = (tmp_path / "out" / "assess.csv").read_bytes()
    settings = AssessSettings(**given)
    assert 2 <= sum(status_counts(made.rows).values()) <= MOST_DRAWS * settings.cases
    variants = {row.variant for row in made.rows if row.motion == RANDOM and row.robot is not None}
    assert variants == {"", *variants_of(BELT)}
    assert {row.motion for row in made.rows} == {RANDOM, *(one.name for one in typical_motions(BELT))}
    assert 6 <= len(made.shown) <= 14 and "assumed" in made.shown[0]
    assert RobotFile.model_validate({**read_robot(BELT).model_dump(), "tuning": made.content["tuning"]})
    page = made.page.read_text(encoding="utf-8")
    assert page.index("<figure>") < page.index("<table>")
    # it is stated whether another tuning would do better
    assert "the present 37.7 rad/s" in page
    # torn as by an interruption
    (tmp_path / "out" / "assess.csv").write_bytes(rows[: len(rows) // 2])
    run_study(ASSESSMENT, given, tmp_path / "out")
    assert (tmp_path / "out" / "assess.csv").read_bytes() == rows
