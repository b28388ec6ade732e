# SPDX-License-Identifier: Apache-2.0
"""The benchmark: the crossings that are shipped, the rules of success, and results that are continued."""

from __future__ import annotations

import json
import math
import signal
from dataclasses import replace
from itertools import islice
from pathlib import Path

import pytest
from full_disk import full_disk
from typer.testing import CliRunner

from fivebar_bringup.cli.main import app
from fivebar_bringup.odds.odds import Interval, clopper_pearson
from fivebar_description.strict_yaml import InputError
from fivebar_studies.benchmark.crossings import (
    CROSSINGS,
    BenchmarkCrossing,
    benchmark,
    crossing_of,
    drawn_crossings,
    robot_of_all,
)
from fivebar_studies.benchmark.running import NOT_STARTED, BenchmarkSettings
from fivebar_studies.benchmark.scoring import RESULTS, Result, read_results, scores, success
from fivebar_studies.benchmark.study import BENCHMARK
from fivebar_studies.engine import chunks
from fivebar_studies.engine.running import run_study

CROSSING = BenchmarkCrossing(0, 1, 1, 0.0, 0.15, 0.0, 0.02, 1.0, 1)
HEAD = RESULTS.head
GOOD = Result(0, "ideal", "mine", "", 1, 1.9e-3, 0.9e-3, 2.0)


def test_the_shipped_crossings_are_those_that_are_drawn() -> None:
    crossings = benchmark()
    assert [one.crossing for one in crossings] == list(range(CROSSINGS))
    assert crossings[:3] == list(islice(drawn_crossings(), 3))
    assert all(one.mode_changes % 2 == 1 for one in crossings)


@pytest.mark.parametrize(
    ("successes", "runs", "interval"),
    [(0, 10, (0.0, 0.3085)), (10, 10, (0.6915, 1.0)), (8, 10, (0.4439, 0.9748)), (0, 0, (0.0, 1.0))],
)
def test_the_interval_is_that_of_clopper_and_pearson(successes: int, runs: int, interval: tuple[float, float]) -> None:
    assert clopper_pearson(successes, runs) == pytest.approx(Interval(*interval), abs=5e-5)


@pytest.mark.parametrize(
    "change",
    [
        {"fault": "tracking_lost"},
        {"mode_changes": 0},
        {"error_peak": 2e-3},
        {"error_peak": float("nan")},
        {"error_final": 1e-3},
        {"torque": 2.01},
    ],
)
def test_every_rule_decides(change: dict[str, object]) -> None:
    assert success(GOOD, CROSSING)
    assert not success(GOOD._replace(**change), CROSSING)  # type: ignore[arg-type]


def test_any_robot_makes_crossings_of_its_own_and_is_judged_by_its_size_and_torque() -> None:
    settings = BenchmarkSettings(rigs=("ideal", "encoders"), controllers=("unified",), cases=2, robot="motkin")
    crossings = [crossing_of(settings.make, number) for number in (0, 1)]
    assert [one.crossing for one in crossings] == [0, 1]
    assert crossings[0] == crossing_of("motkin", 0) != crossings[1]._replace(crossing=0)
    assert settings.limits == pytest.approx((2e-3 * 8 / 9, 1e-3 * 8 / 9, 0.186))
    found = [result for number in (0, 1) for result in BENCHMARK.run(settings, number)]
    assert [(result.crossing, result.rig) for result in found] == [(n, rig) for n in (0, 1) for rig in settings.rigs]
    assert [success(result, crossings[result.crossing], settings.limits) for result in found] == [True] * 4
    # with encoders its body differs from the model, and the torque comes in steps
    assert found[1].error_peak > 3.0 * found[0].error_peak
    assert found[0].torque < 0.1
    barely = found[0]._replace(error_peak=1.9e-3)
    assert success(barely, crossings[0]) and not success(barely, crossings[0], settings.limits)


def test_rigs_of_one_robot_share_its_crossings(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert robot_of_all(["ideal", "good"]) == "dextar"
    assert robot_of_all(["printed", "printed_calibrated"]) == "motkin"
    for words, said in (
        (["--rig", "good,printed"], "--rig: 'printed': has the robot motkin: expected rigs of dextar, as 'good' is"),
        (
            ["--rig", "good", "--robot", "motkin"],
            "--rig: 'good': has the robot dextar: expected ideal or encoders with",
        ),
        (["--robot", "motkn"], "robot 'motkn'"),
    ):
        called = CliRunner().invoke(app, ["benchmark", *words])
        assert (called.exit_code, called.stderr.count("\n")) == (2, 1), called.output
        assert said in called.stderr
    assert not list(tmp_path.iterdir()), "what is refused leaves no directory"


def test_a_crossing_without_a_line_is_a_failure() -> None:
    (score,) = scores([GOOD], [CROSSING, CROSSING._replace(crossing=1)])
    assert (score.successes, score.crossings) == (1, 2)
    assert score.interval == clopper_pearson(1, 2)


REFUSED = {
    "crossing,error\n": "line 1: expected crossing,rig,controller",
    HEAD + "0,ideal,mine,,1,x,0,1\n": "line 2: error_peak: 'x': expected a number",
    HEAD + "0,ideal,mine,,1,-0.001,0,1\n": "line 2: error_peak: -0.001: expected a number, at least 0",
    HEAD + "0,ideal,mine,,1,0,-1e-9,1\n": "line 2: error_final: -1e-09: expected a number, at least 0",
    HEAD + "0,ideal,mine,,1,0,0,-inf\n": "line 2: torque: -inf: expected a number, at least 0",
    HEAD + "0,ideal,mine,,-1,0,0,1\n": "line 2: mode_changes: -1: expected a number, at least 0",
    HEAD + RESULTS.lines([GOOD]) + "-1,a,b,,1,0,0,1\n": "line 3: crossing: -1: expected a whole number from 0 to 999",
    HEAD + "1000,a,b,,1,0,0,1\n": "line 2: crossing: 1000: expected a whole number from 0 to 999",
    HEAD + "0.5,a,b,,1,0,0,1\n": "line 2: crossing: '0.5': expected a whole number",
    HEAD + "0,,b,,1,0,0,1\n": "line 2: rig: '': expected a name",
    HEAD + "0,a,,,1,0,0,1\n": "line 2: controller: '': expected a name",
    HEAD + "0,a,b,,1,0,0\n": "line 2: '0,a,b,,1,0,0': expected 8 entries",
    HEAD + "0,a,b,,1,0,0,1,1\n": "line 2: '0,a,b,,1,0,0,1,1': expected 8 entries",
    HEAD + 2 * RESULTS.lines([GOOD]): "line 3: crossing: 0: is given twice for 'ideal' and 'mine': expected once",
}


@pytest.mark.parametrize(("text", "words"), REFUSED.items())
def test_what_is_no_file_of_results_is_refused(text: str, words: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.csv"
    file.write_text(text, encoding="utf-8")
    called = CliRunner().invoke(app, ["benchmark", "--score", str(file)])
    assert called.exit_code == 2
    assert called.stderr.startswith(f"fivebar: {file}: {words}")
    assert called.stderr.count("\n") == 1


def test_a_byte_order_mark_changes_no_score(tmp_path: Path) -> None:
    text = (
        "crossing,rig,controller,fault,mode_changes,error_peak,error_final,torque\n"
        "1,ideal,unified,,1,0.00012311395721962791,4.54251373248706e-06,2.0\n"
        "2,ideal,unified,,1,5.2548293202637005e-06,1.111061509387434e-06,0.6024017541\n"
        "0,ideal,unified,,1,1.1479975499427722e-05,4.5237035405911515e-07,0.7253980064261953\n"
    )
    outputs = []
    for mark in ("", "\ufeff"):
        file = tmp_path / "mine.csv"
        file.write_text(mark + text, encoding="utf-8")
        outputs.append(CliRunner().invoke(app, ["benchmark", "--score", str(file), "--json"]).output)
    (score,) = json.loads(outputs[0])["scores"]
    assert (score["successes"], outputs[1]) == (3, outputs[0])


def test_what_is_not_known_of_a_run_may_be_missing_from_its_result() -> None:
    text = HEAD + "0,ideal,mine,not_started,0,nan,nan,nan\n" + "999,ideal,mine,,1,inf,inf,inf\n"
    first, last = read_results(text, "mine.csv")
    assert all(math.isnan(number) for number in first[5:])
    assert last == Result(999, "ideal", "mine", "", 1, math.inf, math.inf, math.inf)


def test_results_are_continued_and_scored(tmp_path: Path) -> None:
    given = {"controllers": ("unified",), "cases": 3}
    first = run_study(BENCHMARK, given, tmp_path / "out")
    assert [success(result, crossing) for result, crossing in zip(first.rows, benchmark(), strict=False)] == [True] * 3
    file = tmp_path / "out" / "benchmark.csv"
    whole = file.read_text(encoding="utf-8")
    file.write_text(whole[:-20], encoding="utf-8")
    steps: list[tuple[int, int]] = []
    again = run_study(BENCHMARK, {}, tmp_path / "out", progress=lambda *step: steps.append(step))
    assert again.rows == first.rows
    # two crossings are a chunk, and the last one that has rows may lack some
    assert steps == [(0, 3), (2, 3), (3, 3)]
    assert file.read_text(encoding="utf-8") == whole
    called = CliRunner().invoke(app, ["benchmark", "--score", str(file), "--crossings", "3", "--json"])
    (score,) = json.loads(called.stdout)["scores"]
    assert (score["rig"], score["controller"], score["successes"], score["crossings"]) == ("ideal", "unified", 3, 3)
    assert called.stderr == "fivebar: --crossings is deprecated: use --cases\n"


def good_results(settings: BenchmarkSettings, number: int) -> list[Result]:
    return [GOOD._replace(crossing=number, controller=name) for name in settings.controllers]


def test_an_interrupted_benchmark_says_what_is_kept_and_how_to_resume(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Also one that names a file, as former versions had it."""

    def run_first(settings: BenchmarkSettings, number: int) -> list[Result]:
        if number == BENCHMARK.chunk(settings):
            signal.raise_signal(signal.SIGINT)
        return good_results(settings, number)

    monkeypatch.setattr(chunks, "load_part", lambda place: replace(BENCHMARK, run=run_first))
    words = ["benchmark", "--controllers", "ctc", "--jobs", "1", "--out", str(tmp_path / "results.csv")]
    called = CliRunner().invoke(app, words)
    assert called.exit_code == 130
    out = tmp_path / "results"
    assert called.stderr == (
        f"fivebar: --out FILE.csv is deprecated: the results are in {out / 'benchmark.csv'}\n"
        f"fivebar: {out}: interrupted: benchmark.csv keeps the finished cases:"
        f" the same command with --out {out} resumes\n"
    )
    found = read_results((out / "benchmark.csv").read_text(encoding="utf-8"), "")
    assert found == [
        result for number in (0, 1) for result in good_results(BenchmarkSettings(controllers=("ctc",)), number)
    ]


def test_a_benchmark_on_a_full_disk_names_the_file_and_resumes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The file has whole lines, those of the chunks before, also where a line had room in part."""
    study = replace(BENCHMARK, run=good_results)
    monkeypatch.setattr(chunks, "load_part", lambda place: study)
    given, file = {"controllers": ("mine:LAW",), "cases": 4}, tmp_path / "benchmark.csv"
    whole = HEAD + RESULTS.lines(GOOD._replace(crossing=number, controller="mine:LAW") for number in range(4))
    monkeypatch.setattr("fivebar_studies.benchmark.study.program_digest", lambda *_, modules: "")
    with full_disk(len(whole) - 5), pytest.raises(InputError) as error:
        run_study(study, given, tmp_path)
    assert str(error.value) == f"{file}: cannot be used for the results: File too large"
    assert file.read_text(encoding="utf-8") == "".join(whole.splitlines(keepends=True)[:-2])
    run_study(study, given, tmp_path)
    assert file.read_text(encoding="utf-8") == whole


def test_a_start_that_the_estimator_refuses_is_no_success() -> None:
    assert not success(GOOD._replace(fault=NOT_STARTED), CROSSING)
