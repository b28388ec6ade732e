# SPDX-License-Identifier: Apache-2.0
"""The sweep: cases from their numbers, the same bytes however they were made, the rule of success, what is refused."""

from __future__ import annotations

import json
import math
import shutil
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from full_disk import full_disk
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.odds.odds import shortcomings
from fivebar_bringup.simulation.offline import OfflineRun, simulate
from fivebar_bringup.simulation.run_metrics import RunMetrics
from fivebar_control.estimation.fault_numbers import ESTIMATE_AMBIGUOUS
from fivebar_control.laws.registry import find_controller
from fivebar_control.model.kinematics import det_a, state_from_joints, state_from_platform
from fivebar_control.planning.alternative_courses import TimedCourse
from fivebar_control.planning.course import Course
from fivebar_control.planning.figures import Figure
from fivebar_control.planning.postures import WORKING_MODES
from fivebar_control.safety.stages import TRACKING_LOST
from fivebar_control.trajectory.time_laws import OPTIMAL
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import InputError
from fivebar_studies.engine import running as engine
from fivebar_studies.engine.directory import StudyFiles
from fivebar_studies.engine.directory import opened as opened_study
from fivebar_studies.engine.program import deciding_files, matching
from fivebar_studies.engine.running import Progress, run_study, silent
from fivebar_studies.sweep import figures
from fivebar_studies.sweep import sweep as sweeping
from fivebar_studies.sweep.drawing import ENCODERS, LONGEST, SHORTEST, SPREAD, Draw, draw
from fivebar_studies.sweep.explanations import CHANGES, explained
from fivebar_studies.sweep.rows import FEASIBLE, REFUSED, ROWS, SCREENED_OUT, SweepRow
from fivebar_studies.sweep.running import SWEPT, counted, run_case, use_of
from fivebar_studies.sweep.statistics import (
    branch_table,
    error_table,
    overview_table,
    planner_reason,
    refusals_table,
)
from fivebar_studies.sweep.sweep import DECIDING, SWEEP, SweepSettings

SEED, CASES = 3, 5
ROBOT = load_robot("dextar")
BATCH = SWEEP.chunk(SWEEP.settings())
HEAD = ROWS.head

Files = StudyFiles[SweepSettings, SweepRow]


def sweep(path: Path, seed: int | None = None, cases: int | None = None, progress: Progress = silent) -> None:
    run_study(SWEEP, {"seed": seed, "cases": cases}, path, progress=progress)


def opened(path: Path, seed: int | None, cases: int | None, **others: Any) -> tuple[Files, SweepSettings]:
    return opened_study(SWEEP, path, {"seed": seed, "cases": cases, **others})


def rows_in(path: Path) -> list[SweepRow]:
    return StudyFiles(SWEEP, path).read_rows()


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A small sweep, made at one go in this process."""
    path = tmp_path_factory.mktemp("sweep") / "whole"
    sweep(path, SEED, CASES)
    return path


@pytest.fixture(scope="module")
def rows(made: Path) -> list[SweepRow]:
    return rows_in(made)


def side(case: Draw, x: float, y: float) -> float:
    return math.copysign(1.0, det_a(state_from_platform(ROBOT, (case.mode1, case.mode2), x, y, 0.0, 0.0)))


def test_cases_are_what_is_promised() -> None:
    cases = [draw(SEED, number) for number in range(400)]
    for case in cases:
        assert side(case, case.start_x, case.start_y) == -side(case, case.end_x, case.end_y)
        assert SHORTEST <= case.duration <= LONGEST
        assert all(abs(scale - 1.0) <= SPREAD for scale in case[8:11])
    kinds = {(case.encoder_counts, case.delay_samples) for case in cases}
    assert kinds == {(counts, delay) for counts in ENCODERS for delay in (0, 1)}
    assert {(case.mode1, case.mode2) for case in cases} == set(WORKING_MODES)
    # evenly on a logarithmic scale: half of them below the geometric mean
    below = np.mean([case.duration < math.sqrt(SHORTEST * LONGEST) for case in cases])
    assert abs(below - 0.5) < 0.1
    scales = np.array([case[8:11] for case in cases])
    assert np.all(np.abs(np.corrcoef(scales.T)[np.triu_indices(3, 1)]) < 0.2)


def test_a_case_depends_on_its_seed_and_number_alone() -> None:
    backwards = [draw(SEED, number) for number in reversed(range(20))]
    assert backwards[::-1] == [draw(SEED, number) for number in range(20)]
    assert draw(SEED, 5) != draw(SEED + 1, 5)
    assert len({case[3:] for case in backwards}) == 20


def test_a_case_that_is_led_through_another_place_can_be_repeated_from_its_row() -> None:
    case = draw(1, 0, "middling")
    start, goal = (case.start_x, case.start_y), (case.end_x, case.end_y)
    assert case.legs() == ((start, goal), (case.duration,))
    between = (0.1 + 0.2, 1.0 / 3.0)
    led = case.along(TimedCourse(Course((start, between, goal), (0.0,), OPTIMAL), (0.3, 0.4)))
    assert led.legs() == ((start, between, goal), (0.3, 0.4))
    assert (led.duration, led.drawn_duration, led.time_law) == (0.7, case.duration, OPTIMAL)
    row = SweepRow(0, "unified", FEASIBLE, "", True, "", *led[1:])
    assert ROWS.read(ROWS.lines([row]))[0].draw == led
    straight = led.along(TimedCourse(Course((start, goal)), (case.duration,)))
    assert straight == case


def test_a_case_is_run_with_its_own_robot_and_the_gains_of_its_rig() -> None:
    cases = [draw(SEED, number) for number in range(40)]
    exact = next(case for case in cases if case.encoder_counts is None).scenario("unified")
    encoders = next(case for case in cases if case.encoder_counts == 8192 and case.delay_samples == 1)
    scenario = encoders.scenario("multi_joint")
    assert (exact.estimator, exact.plant.torque_quantum, exact.plant.torque_limit) == ("none", 0.0, 2.0)
    assert (scenario.estimator, scenario.plant.encoder_counts, scenario.plant.torque_limit) == ("ekf", 8192, 2.0)
    assert (scenario.plant.mass_scale, scenario.plant.delay_samples) == (encoders.mass_scale, 1)
    assert scenario.gains.kp < exact.gains.kp
    assert scenario.rate_hz == exact.rate_hz == 500


OUTCOME = RunMetrics(*([0] * len(RunMetrics._fields)))._replace(
    samples=101, mode_changes=1, error_peak=1e-3, error_final=5e-4
)


@pytest.mark.parametrize(
    ("change", "missed"),
    [
        ({}, []),
        ({"error_peak": 1.9999e-3, "error_final": 0.9999e-3}, []),
        ({"error_peak": 2e-3}, ["peak error 2.00 mm"]),
        ({"error_final": 1e-3}, ["final error 1.00 mm"]),
        ({"error_peak": math.nan}, ["peak error nan mm"]),
        ({"mode_changes": 3}, ["3 changes of assembly mode, planned 1"]),
        ({"mode_changes": 0}, ["0 changes of assembly mode, planned 1"]),
        ({"samples": 100}, ["100 of 101 samples"]),
        ({"fault": TRACKING_LOST, "samples": 40}, ["fault tracking_lost"]),
        ({"fault": ESTIMATE_AMBIGUOUS, "error_final": 0.02}, ["fault estimate_ambiguous", "final error 20.00 mm"]),
    ],
)
def test_the_rule_of_success(change: dict[str, Any], missed: list[str]) -> None:
    assert shortcomings(OUTCOME._replace(**change), 101, 1) == missed


def test_the_use_of_a_limit() -> None:
    assert use_of(Figure("torque", 1.0, 2.0, True, 0.0, 0.0, 0.0)) == 0.5
    assert use_of(Figure("kappa", 0.1, 0.05, False, 0.0, 0.0, 0.0)) == 0.5
    assert use_of(Figure("kappa", 0.0, 0.05, False, 0.0, 0.0, 0.0)) == math.inf
    assert use_of(Figure("torque", math.nan, 2.0, True, 0.0, 0.0, 0.0)) == math.inf


@pytest.mark.extra
def test_every_case_has_a_row_per_controller_or_one_refusal(rows: list[SweepRow]) -> None:
    numbers = sorted({row.case for row in rows})
    assert numbers == list(range(len(numbers))) and len(numbers) % BATCH == 0
    for number in numbers:
        own = [row for row in rows if row.case == number]
        assert tuple(row.controller for row in own) in (SWEPT, ("",))
        assert {row.draw for row in own} == {draw(SEED, number)}
    feasible = [row.case for row in rows if (row.controller, row.status) == ("unified", FEASIBLE)]
    assert len(feasible) >= CASES > sum(number < numbers[-1] + 1 - BATCH for number in feasible)
    assert {row.status for row in rows} == {REFUSED, SCREENED_OUT, FEASIBLE}
    assert all((row.limit_use <= 1.0) == (row.status == FEASIBLE) for row in rows if row.limit_use is not None)
    assert all(bool(row.why_not) == (row.success is False) for row in rows)
    assert "other" not in {planner_reason(row.reason) for row in rows if row.status == REFUSED}


def exact_places(run: OfflineRun) -> list[tuple[float, float]]:
    places = []
    for sample in run.samples:
        state = state_from_joints(ROBOT, *sample.exact.position, *sample.exact.velocity)
        places.append((state.x, state.y))
    return places


@pytest.mark.extra
@pytest.mark.parametrize("with_encoders", [False, True])
def test_a_row_holds_what_the_offline_runner_finds(rows: list[SweepRow], with_encoders: bool) -> None:
    """Another plant, uncompiled laws: errors, torques and changes of assembly mode of a drawn case."""
    row = next(
        row
        for row in sorted(rows, key=lambda row: row.duration)
        if row.controller == "unified" and row.success and (row.encoder_counts is not None) == with_encoders
    )
    scenario = row.draw.scenario("unified")
    run, plan = simulate(scenario), scenario.plan()
    errors = [
        math.hypot(x - plan.path.at(number / 500).x, y - plan.path.at(number / 500).y)
        for number, (x, y) in enumerate(exact_places(run))
    ]
    assert row.samples == len(errors)
    assert row.error_peak == pytest.approx(max(errors), abs=1e-9)
    assert row.error_final == pytest.approx(errors[-1], abs=1e-9)
    asked = [abs(torque) for sample in run.samples if sample.requested for torque in sample.requested]
    assert row.requested == pytest.approx(max(asked), rel=1e-6)


@pytest.mark.extra
def test_rows_survive_the_file(rows: list[SweepRow]) -> None:
    assert ROWS.read(ROWS.lines(rows)) == rows
    with pytest.raises(ValueError, match="expected"):
        ROWS.read("1,unified,feasible\n")


@pytest.mark.extra
@pytest.mark.usefixtures("no_figures")
def test_a_row_whose_status_is_unknown_is_refused_and_not_left_uncounted(made: Path, tmp_path: Path) -> None:
    path = tmp_path / "spoilt"
    shutil.copytree(made, path)
    lines = (path / "sweep.csv").read_text().splitlines(keepends=True)
    at = next(number for number, line in enumerate(lines) if f",{FEASIBLE}," in line)
    lines[at] = lines[at].replace(f",{FEASIBLE},", ",feas,", 1)
    (path / "sweep.csv").write_text("".join(lines))
    called = CliRunner().invoke(app, ["sweep", "--out", str(path)])
    assert called.exit_code == 2
    expected = f"status: 'feas': expected one of {REFUSED}, {SCREENED_OUT}, {FEASIBLE}"
    assert called.stderr == f"fivebar: {path / 'sweep.csv'}: line {at + 1}: {expected}\n"
    assert (path / "sweep.csv").read_text() == "".join(lines)


@pytest.fixture
def no_figures(monkeypatch: pytest.MonkeyPatch) -> None:
    """They take seconds, and there is one sweep that has them."""
    monkeypatch.setattr(figures, "sweep_figures", lambda rows: [])


@pytest.mark.extra
@pytest.mark.usefixtures("no_figures")
def test_resumed_halves_give_the_same_bytes(made: Path, rows: list[SweepRow], tmp_path: Path) -> None:
    """One batch is whole, and the next one is torn: in a line, or between two rows of a case."""
    lines = [HEAD, *ROWS.lines(row for row in rows if row.case < 2 * BATCH).splitlines(keepends=True)]
    for name, torn in (("row", "".join(lines[:-1])), ("line", "".join(lines)[: -len(lines[-1]) // 2])):
        begun, _ = opened(tmp_path / name, SEED, CASES)
        begun.rows.write_text(torn)
        sweep(begun.path)
        assert begun.rows.read_bytes() == (made / "sweep.csv").read_bytes()
        assert (begun.path / "sweep.json").read_bytes() == (made / "sweep.json").read_bytes()


@pytest.mark.extra
@pytest.mark.usefixtures("no_figures")
def test_what_an_interruption_leaves_can_be_continued(made: Path, tmp_path: Path) -> None:
    calls = []

    def interrupt(done: int, total: int) -> None:
        calls.append((done, total))
        if len(calls) == 2:
            raise KeyboardInterrupt

    path = tmp_path / "interrupted"
    with pytest.raises(KeyboardInterrupt):
        sweep(path, SEED, CASES, interrupt)
    assert 0 < len(rows_in(path)) < len(rows_in(made))
    assert not (path / "sweep.html").exists()
    sweep(path)
    assert (path / "sweep.csv").read_bytes() == (made / "sweep.csv").read_bytes()


@pytest.mark.extra
@pytest.mark.usefixtures("no_figures")
def test_a_sweep_on_a_full_disk_names_the_file_and_resumes(made: Path, tmp_path: Path) -> None:
    path = tmp_path / "full"
    whole = (made / "sweep.csv").read_bytes()
    with full_disk(len(whole) - 100), pytest.raises(InputError) as error:
        sweep(path, SEED, CASES)
    assert str(error.value) == f"{path / 'sweep.csv'}: cannot be used for the results: File too large"
    kept = (path / "sweep.csv").read_bytes()
    assert len(HEAD) < len(kept) < len(whole) and kept.endswith(b"\n")
    sweep(path)
    assert (path / "sweep.csv").read_bytes() == whole


def test_an_interrupted_sweep_says_what_is_kept_and_how_to_resume(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also where the directory was given no name, which the same command would not find again."""

    def interrupted(*_: object) -> None:
        signal.raise_signal(signal.SIGINT)

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(engine, "further_rows", interrupted)
    called = CliRunner().invoke(app, ["sweep", "--quick"])
    (made_here,) = Path("runs").iterdir()
    assert called.exit_code == 130
    assert called.stderr == (
        f"fivebar: {made_here}: interrupted: sweep.csv keeps the finished cases:"
        f" the same command with --out {made_here} resumes\n"
    )


@pytest.mark.extra
@pytest.mark.usefixtures("no_figures")
def test_a_sweep_of_one_controller_has_its_rows_of_the_sweep_of_all(rows: list[SweepRow], tmp_path: Path) -> None:
    path = tmp_path / "one"
    done = CliRunner().invoke(
        app,
        [
            "sweep",
            "--seed",
            str(SEED),
            "--cases",
            str(CASES),
            "--jobs",
            "1",
            "--controllers",
            "unified",
            "--out",
            str(path),
        ],
    )
    assert done.exit_code == 0, done.output
    assert rows_in(path) == [row for row in rows if row.controller in ("", "unified")]
    assert f"fivebar sweep --seed {SEED} --controllers unified --cases {CASES}" in (path / "sweep.html").read_text()
    with pytest.raises(InputError, match="controllers unified, not ctc, unified"):
        opened(path, None, None, controllers=("ctc", "unified"))
    assert opened(path, None, None)[1].controllers == ("unified",)


@pytest.mark.extra
def test_laws_with_zones_make_the_motion_that_is_planned_for_unified() -> None:
    # a robot with a gyroscope, and a crossing that the planner would refuse to the law by itself: |n.v1| = 0.19
    blended, unified = run_case(90, 0, "calibrated", ("multi_cartesian", "unified"))
    assert (blended.status, unified.status) == (SCREENED_OUT, FEASIBLE)
    assert "|n.v1|" in blended.reason
    assert blended.draw == unified.draw
    assert blended.authority == unified.authority < find_controller("multi_cartesian").min_authority
    # and why it failed is found on that motion
    assert 0.0 < explained(blended).worst.error <= blended.error_peak


def test_any_robot_is_swept_and_judged_by_its_torque_and_size() -> None:
    case = draw(SEED, 0, name="motkin")
    scenario, ratio = case.scenario("unified"), 0.035 / 0.55
    assert (scenario.robot, scenario.plant.torque_limit) == ("motkin", 0.186)
    assert scenario.unified.weight == pytest.approx(0.3 / ratio**2)
    sensed = next(one for one in (draw(SEED, number, name="motkin") for number in range(9)) if one.encoder_counts)
    assert sensed.scenario("unified").plant.torque_quantum == pytest.approx(0.002 * ratio)
    assert (case.size, draw(SEED, 0).size) == (pytest.approx(0.08 / 0.09), 1.0)
    assert shortcomings(OUTCOME._replace(error_peak=1.8e-3), 101, 1, 2e-3 * case.size) == ["peak error 1.80 mm"]
    done = CliRunner().invoke(app, ["sweep", "--robot", "motkin", "--rig", "good"])
    assert (done.exit_code, done.stderr.count("\n")) == (2, 1) and "--robot" in done.stderr


def test_the_crossings_that_count_are_those_of_unified_or_of_the_first_controller() -> None:
    assert [counted(names) for names in (SWEPT, ("lqr", "unified"), ("mpc", "lqr"))] == ["unified", "unified", "mpc"]


@pytest.mark.extra
def test_other_settings_are_refused(made: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match="seed 3, not 4"):
        opened(made, 4, None)
    with pytest.raises(InputError, match="cases 5, not 3"):
        opened(made, SEED, 3)
    (tmp_path / "something").write_text("else")
    with pytest.raises(InputError, match="not empty"):
        opened(tmp_path, SEED, CASES)
    with StudyFiles(SWEEP, made).alone(), pytest.raises(InputError, match="another sweep"):
        sweep(made)
    monkeypatch.setattr(sweeping, "program_digest", lambda *_: "new")
    with pytest.raises(InputError, match="not new"):
        opened(made, None, None)


@pytest.mark.extra
def test_the_digest_covers_every_module_that_a_run_of_a_case_loads(tmp_path: Path) -> None:
    code = (
        "import sys, fivebar_studies.sweep.running\n"
        "from fivebar_description.optional import CAMERA_FRAMES, optional_part\n"
        "optional_part(CAMERA_FRAMES, 'a camera')\n"
        "for name, module in list(sys.modules.items()):\n"
        "    if name.startswith('fivebar_') and not module.__file__.endswith('__init__.py'): print(module.__file__)"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert len(loaded) > 50
    assert {Path(file) for file in loaded} <= set(deciding_files(DECIDING).values())
    with pytest.raises(FileNotFoundError, match="gone/"):
        matching(tmp_path, "gone/*.py")


def test_a_spoilt_directory_is_refused(tmp_path: Path) -> None:
    begun, _ = opened(tmp_path / "spoilt", SEED, CASES)
    begun.rows.write_text("case,something\n1,2\n")
    with pytest.raises(InputError, match="another line"):
        rows_in(begun.path)
    begun.rows.write_text(HEAD + "1,2\n")
    with pytest.raises(InputError, match="expected"):
        rows_in(begun.path)
    begun.rows.write_text(
        HEAD + ROWS.lines(SweepRow(case, "", REFUSED, "", None, "", *draw(SEED, case)[1:]) for case in (0, 2))
    )
    with pytest.raises(InputError, match="lacks cases"):
        rows_in(begun.path)
    content = begun.directory.content
    content.write_text(content.read_text().replace('"unified"', '"nobody"'))
    with pytest.raises(InputError, match="not the file of a sweep"):
        opened(begun.path, None, None)
    content.write_text("{}")
    with pytest.raises(InputError, match="not the file of a sweep"):
        opened(begun.path, None, None)


def test_tables_count_what_the_rows_say() -> None:
    plain = draw(SEED, 0)[1:]
    runs = [
        SweepRow(
            number, "unified", FEASIBLE, "", number > 0, "" if number else "peak", *plain, error_peak=1e-3 * number
        )
        for number in range(1000)
    ]
    out = SweepRow(1000, "unified", SCREENED_OUT, "motor speed is 60; reference torque is 3", False, "peak", *plain)
    shares = [row[3].good for required in (0.999, 0.9991) for row in overview_table([*runs, out], required).rows]
    assert shares == [True, False]
    overview = {row[0].text: row for row in overview_table([*runs, out], 0.999).rows}["unified"]
    assert [cell.text for cell in overview[1:]] == [
        "1000",
        "999",
        "99.90 %",
        "99.44 to 100.00 %",
        "1001",
        "999",
        "99.80 %",
    ]
    assert overview[3].good is True
    errors = next(row for row in error_table(runs).rows if row[0].text == "peak error" and row[1].text == "unified")
    assert errors[2].value == pytest.approx(0.4995) and errors[-1].value == pytest.approx(0.999)
    assert {row[2].text: row[3].value for row in refusals_table([out]).rows} == {
        "motor speed": 1,
        "reference torque": 1,
    }
    by_branch = [
        *(run._replace(distal_links="folded" if run.case % 4 else "stretched") for run in runs),
        out._replace(distal_links="folded"),
    ]
    counts = {row[1].text: [row[number].value for number in (2, 3, 6, 7)] for row in branch_table(by_branch).rows}
    assert counts == {"stretched": [250, 249, 250, 249], "folded": [750, 750, 751, 750]}
    missed = overview_table([run._replace(success=run.case > 1) for run in runs], 0.999).rows
    assert {row[0].text: row for row in missed}["unified"][3].good is False


@pytest.mark.extra
def test_a_failure_is_explained_by_what_would_have_saved_it() -> None:
    """One with exact sensors: neither can they save it, nor can what the controller knows be wrong."""
    row = next(
        row
        for number in range(200)
        for row in run_case(SEED, number)
        if row.controller == "unified" and row.success is False and row.encoder_counts is None and not row.fault
    )
    explanation = explained(row)
    assert explanation.worst.error == pytest.approx(row.error_peak)
    assert explanation.worst.estimate_off == pytest.approx(0.0, abs=1e-12)
    assert set(explanation.saved_by) <= set(CHANGES) and "exact sensors" not in explanation.saved_by
    assert row.why_not in explanation.text


@pytest.mark.extra
def test_the_page_asks_nothing_of_the_network(made: Path) -> None:
    page = (made / "sweep.html").read_text()
    assert "http://" not in page and "https://" not in page
    assert "called feasible" in page and f"fivebar sweep --seed {SEED} --cases {CASES}" in page
    content = json.loads((made / "sweep.json").read_text())
    assert content["finished"] and content["settings"]["seed"] == SEED
    assert {path.stem for path in (made / "figures").iterdir()} == {"errors", "factors", "maps"}


@pytest.mark.extra
def test_the_command_prints_a_case_and_writes_what_runs_it_again(rows: list[SweepRow], tmp_path: Path) -> None:
    row = next(row for row in rows if row.controller == "unified")
    out = tmp_path / "case"
    command = ["sweep", "--seed", str(SEED), "--case", str(row.case), "--controllers", "unified"]
    done = CliRunner().invoke(app, [*command, "--out", str(out), "--json"])
    assert done.exit_code == 0, done.output
    (found,) = json.loads(done.stdout)
    assert (found["error_peak"], found["status"]) == (row.error_peak, row.status)
    assert (out / "unified.png").read_bytes().startswith(b"\x89PNG")
    assert "case-" in (out / "unified.yaml").read_text()
    refused = next(row.case for row in rows if row.status == REFUSED)
    done = CliRunner().invoke(app, ["sweep", "--seed", str(SEED), "--case", str(refused)])
    assert done.exit_code == 0 and "refused: " in done.stdout


@pytest.mark.parametrize(
    ("arguments", "expected"),
    [
        (["--quick", "--cases", "5"], "--quick"),
        (["--controllers", "unified,nobody"], "--controllers: 'nobody': expected one of ctc"),
        (["--case", "1", "--controllers", "nobody"], "expected one of ctc"),
    ],
)
def test_bad_input_is_one_line(arguments: list[str], expected: str) -> None:
    done = CliRunner().invoke(app, ["sweep", *arguments])
    assert done.exit_code == 2
    assert expected in done.stderr and len(done.stderr.splitlines()) == 1
