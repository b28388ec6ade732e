# SPDX-License-Identifier: Apache-2.0
"""The moving figure of a report: what it shows is what was recorded, it stays small, and it runs no foreign script."""

from __future__ import annotations

import base64
import hashlib
import html
import json
import re
import shutil
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from PIL import Image

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.pages.scripts import page_scripts
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.recorded.series import RunSeries, read_series
from fivebar_bringup.recorded.summary import summarize
from fivebar_bringup.recorded.timing import RunTiming
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.fault_marks import FaultMark, fault_marks
from fivebar_bringup.report.replay import LONGEST, SCRIPTS, kept_rows, replay_data, replay_scripts
from fivebar_bringup.report.report import write_animation, write_overlay
from fivebar_bringup.report.scene import scene, shared_scene
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import OfflineRun, simulate, write_bag
from fivebar_control.model.geometry import elbow_position
from fivebar_description.robot_file import load_robot
from fivebar_description.strict_yaml import InputError

FAULT = "plant_diverged: after sample 700: <b>too fast</b></script>"


@pytest.fixture(scope="module")
def directory(tmp_path_factory: pytest.TempPathFactory) -> RunDirectory:
    """The middle crossing, cut short by a fault."""
    scenario = load_scenario("middle")
    run = simulate(scenario)
    directory = new_run_directory(tmp_path_factory.mktemp("replay") / "cut", scenario)
    write_bag(OfflineRun(run.samples[:701], [FAULT]), scenario, directory.bag)
    return directory


@pytest.fixture(scope="module")
def analysis(directory: RunDirectory) -> RunAnalysis:
    scenario, recording = directory.read_scenario(), read_bag(directory.bag)
    series = read_series(recording, scenario)
    summary = summarize(recording, series, scenario, RunTiming())
    return RunAnalysis(scenario, scenario.plan(), scenario.five_bar(), series, summary)


def column(data: dict[str, Any], name: str) -> NDArray[np.float32]:
    return np.frombuffer(base64.b64decode(data["runs"][0]["columns"][name]), "<f4")


def repeated(series: RunSeries, count: int, rate_hz: int = 500) -> RunSeries:
    """The same series again and again, `count` rows in all."""
    rows = np.arange(count) % series.sample.size
    kept = {"table": series.table, "robot": series.robot, "vision": series.vision}
    longer = {name: values[rows] for name, values in vars(series).items() if name not in kept}
    return RunSeries(**{**longer, **kept, "sample": np.arange(count), "time": np.arange(count) / rate_hz})


@pytest.mark.extra
def test_the_robot_stands_where_the_bag_says(analysis: RunAnalysis) -> None:
    data = replay_data([("cut", analysis, [])])
    robot, series = data["runs"][0]["robot"], analysis.series
    assert column(data, "time") == pytest.approx(series.time, abs=1e-6)
    for axis, name in enumerate("xy"):
        assert column(data, name) == pytest.approx(1e3 * series.platform[:, axis], abs=1e-4)
    for leg, (name, parameters) in enumerate((("q11", analysis.robot.leg1), ("q21", analysis.robot.leg2))):
        angle = float(column(data, name)[350])
        elbow = robot["base"][leg] + robot["proximal"][leg] * np.cos(angle), robot["proximal"][leg] * np.sin(angle)
        assert elbow == pytest.approx([1e3 * mark for mark in elbow_position(parameters, angle)])
    assert set(column(data, "mode").tolist()) == {1.0, -1.0}


def test_a_motor_that_turns_past_half_a_turn_takes_the_short_way(analysis: RunAnalysis) -> None:
    """The page draws postures between two rows: from 3.1 to -3.1 rad it would turn the link all the way round."""
    series = analysis.series
    turned = vars(series) | {"joint_position": np.array(series.joint_position)}
    turned["joint_position"][:, 0] = np.angle(np.exp(1j * np.linspace(3.0, 3.3, series.sample.size)))
    data = replay_data([("turned", analysis._replace(series=RunSeries(**turned)), [])])
    assert np.max(np.abs(np.diff(column(data, "q11")))) < 0.01


def test_the_locus_is_where_the_robot_crosses_it(analysis: RunAnalysis) -> None:
    crossing = next(row for row in range(700) if analysis.series.det_a[row] * analysis.series.det_a[row + 1] <= 0.0)
    here = 1e3 * analysis.series.platform[crossing, :2]
    locus = np.concatenate([np.array(line) for line in replay_data([("cut", analysis, [])])["scene"]["locus"]])
    assert np.min(np.hypot(*(locus - here).T)) < 1.5


def test_a_fault_has_its_time_and_text(directory: RunDirectory, analysis: RunAnalysis) -> None:
    marks = fault_marks(read_bag(directory.bag), analysis.series)
    assert marks == [FaultMark(pytest.approx(1.4), FAULT)]


def test_a_long_run_is_thinned_but_keeps_its_peaks(analysis: RunAnalysis) -> None:
    series = repeated(analysis.series, 50_000)
    series.torque_applied[31_415, 1] = -77.0
    series.tracking_error[27_182] = np.nan
    rows = kept_rows(series)
    assert rows.size <= LONGEST + 1
    assert {0, 31_415, 49_999} <= set(rows.tolist())
    assert np.array_equal(kept_rows(analysis.series), np.arange(701))


def test_twenty_seconds_fit_into_a_page(analysis: RunAnalysis) -> None:
    longer = analysis._replace(series=repeated(analysis.series, 10_001))
    scripts = replay_scripts([("long", longer, [])])
    assert scripts is not None
    # 6 MB less what the figures of a report take
    assert len(scripts.html.encode()) < 3_500_000


def test_the_policy_allows_the_scripts_of_the_page_and_no_others() -> None:
    scripts = page_scripts(SCRIPTS, {"text": FAULT}, "replay-data")
    texts = re.findall(r"<script>(.*?)</script>", scripts.html, re.DOTALL)
    digests = [base64.b64encode(hashlib.sha256(text.encode()).digest()).decode() for text in texts]
    assert scripts.policy == " ".join(["script-src", *(f"'sha256-{digest}'" for digest in digests)])
    (data,) = re.findall(r'<script type="application/json" id="replay-data">(.*?)</script>', scripts.html)
    assert json.loads(data) == {"text": FAULT}


@pytest.mark.extra
def test_two_runs_get_one_page(directory: RunDirectory, tmp_path: Path) -> None:
    other = RunDirectory(Path(shutil.copytree(directory.path, tmp_path / "a&b")))
    page, summaries = write_overlay(directory, other)
    assert page == directory.path / "overlay-a&b.html"
    assert [summary.outcome for summary in summaries] == ["stopped", "stopped"]
    text = page.read_text(encoding="utf-8")
    assert html.escape("Run 2: a&b") in text
    (data,) = re.findall(r'id="replay-data">(.*?)</script>', text)
    assert [run["name"] for run in json.loads(data)["runs"]] == ["cut", "a&b"]


def test_the_second_run_shows_its_own_locus_and_path() -> None:
    robots = load_robot("dextar"), load_robot("motkin")
    same, other = (
        [scene(robot, (1, -1), ends, ends) for robot in pair]
        for pair, ends in (((robots[0],) * 2, [(0.0, 0.15), (0.0, 0.02)]), (robots, [(0.0, 0.12), (0.0, 0.01)]))
    )
    assert "second" not in shared_scene(same[:1])
    assert shared_scene(same)["second"] == {"locus": [], "path": [], "waypoints": []}
    both = shared_scene(other)
    assert both["second"]["locus"] == other[1]["locus"] != both["locus"] == other[0]["locus"]
    assert both["second"]["path"] == []
    left, low, right, top = both["bounds"]
    for one in other:
        assert left <= one["bounds"][0] and low <= one["bounds"][1]
        assert right >= one["bounds"][2] and top >= one["bounds"][3]


@pytest.mark.extra
def test_an_animation_has_the_whole_run(directory: RunDirectory) -> None:
    content = write_animation(directory, "gif").read_bytes()
    picture = Image.open(BytesIO(content))
    assert len(content) < 2_000_000
    assert picture.n_frames > 60
    assert 5.0 < picture.n_frames * picture.info["duration"] / 1000 < 8.0


def test_a_film_needs_ffmpeg(directory: RunDirectory, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("PATH", "")
    with pytest.raises(InputError, match="--mp4: ffmpeg was not found"):
        write_animation(directory, "mp4")
