# SPDX-License-Identifier: Apache-2.0
"""The report in a real browser: it plays from disk, and what it draws is what was recorded."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import pytest
from browser_pages import assert_looks_like, until
from PIL import Image

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.recorded.series import RunSeries, read_series
from fivebar_bringup.recorded.summary import summarize
from fivebar_bringup.recorded.timing import RunTiming
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.fault_marks import fault_marks
from fivebar_bringup.report.page import html_page
from fivebar_bringup.report.replay import replay_scripts
from fivebar_bringup.report.report import write_overlay
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import OfflineRun, simulate, write_bag
from fivebar_control.model.geometry import elbow_position

pytestmark = pytest.mark.extra

FAULT = "plant_diverged: after sample 700: <b>too fast</b>"

OpenPage = Callable[..., Any]


@pytest.fixture(scope="module")
def runs(tmp_path_factory: pytest.TempPathFactory) -> tuple[RunDirectory, RunDirectory]:
    """The middle crossing, once whole and once cut short by a fault."""
    scenario, folder = load_scenario("middle"), tmp_path_factory.mktemp("browser")
    run = simulate(scenario)
    whole, cut = (new_run_directory(folder / name, scenario) for name in ("whole", "cut"))
    write_bag(run, scenario, whole.bag)
    write_bag(OfflineRun(run.samples[:701], [FAULT]), scenario, cut.bag)
    for directory in (whole, cut):
        write_page(directory)
    return whole, cut


def write_page(run: RunDirectory) -> None:
    """Write the report without its figures, which take most of the time and do not move."""
    scenario, recording = run.read_scenario(), read_bag(run.bag)
    series = read_series(recording, scenario)
    summary = summarize(recording, series, scenario, RunTiming())
    analysis = RunAnalysis(scenario, scenario.plan(), scenario.five_bar(), series, summary)
    replay = replay_scripts([(scenario.name, analysis, fault_marks(recording, series))])
    run.page.write_text(html_page(scenario, summary, [], replay), encoding="utf-8")


def series_of(run: RunDirectory) -> RunSeries:
    return read_series(read_bag(run.bag), run.read_scenario())


def opened(open_page: OpenPage, path: Path, **window: Any) -> Any:
    page = open_page(path.as_uri(), **window)
    until(page, "!!window.replay")
    page.evaluate("replay.ready")
    return page


def test_the_robot_stands_where_the_bag_says(runs: tuple[RunDirectory, RunDirectory], open_page: OpenPage) -> None:
    page, series = opened(open_page, runs[0].page), series_of(runs[0])
    robot = runs[0].read_scenario().five_bar()
    for row in (0, 251, 500, 777, 1000):
        page.evaluate("time => replay.seek(time)", float(series.time[row]))
        joints = page.evaluate("replay.stage.drawn[0].joints")
        q11, _, q21, _ = series.joint_position[row].tolist()
        places = [
            (robot.leg1.base_x, 0.0),
            elbow_position(robot.leg1, q11),
            series.platform[row, :2].tolist(),
            elbow_position(robot.leg2, q21),
            (robot.leg2.base_x, 0.0),
        ]
        for joint, place in zip(joints, places, strict=True):
            assert joint == pytest.approx([1e3 * value for value in place], abs=0.01)
        # and there the canvas has the colour of the platform in this assembly mode
        column, line = page.evaluate("replay.stage.toPixel(replay.stage.drawn[0].joints[2])")
        picture = Image.open(BytesIO(page.locator("#replay-stage").screenshot())).convert("RGB")
        colour = picture.getpixel((round(column), round(line)))
        assert colour == ((0x00, 0x72, 0xB2) if series.det_a[row] > 0.0 else (0xD5, 0x5E, 0x00))


def test_it_plays_to_the_end_and_the_charts_follow(
    runs: tuple[RunDirectory, RunDirectory], open_page: OpenPage
) -> None:
    page = opened(open_page, runs[0].page)
    page.select_option("#replay-speed", "2")
    page.click("#replay-play")
    until(page, "replay.time >= replay.end && !replay.playing")
    assert page.text_content("#replay-clock") == "2.000 s of 2.000 s, assembly mode +"
    assert page.evaluate("replay.charts.cursors.map(cursor => cursor.location)") == [2.0] * 4
    assert page.text_content("#replay-play") == "Play"


def test_it_says_mode_and_lost_direction_and_hands_out_its_table(
    runs: tuple[RunDirectory, RunDirectory], open_page: OpenPage
) -> None:
    page, series = opened(open_page, runs[0].page), series_of(runs[0])
    page.evaluate("replay.seek(0.502)")
    grip = page.evaluate("gripOf(replay.stage.drawn[0].joints)")
    assert grip["kappa"] == pytest.approx(series.kappa[251], abs=1e-4)
    # down the vertical axis, on which the distal links are level there
    assert [abs(part) for part in grip["direction"]] == pytest.approx([0.0, 1.0], abs=1e-3)
    page.evaluate("replay.seek(0.8)")
    assert page.text_content("#replay-clock").endswith("assembly mode −")
    assert page.evaluate("gripOf(replay.stage.drawn[0].joints).kappa > LITTLE_GRIP")
    with page.expect_download() as saved:
        page.click("#replay-csv")
    assert saved.value.suggested_filename == "middle.csv"
    names, *rows = [line.split(",") for line in Path(saved.value.path()).read_text(encoding="utf-8").splitlines()]
    assert names[:4] == ["time (s)", "x (mm)", "y (mm)", "q11 (rad)"]
    assert [float(value) for value in rows[300][:3]] == pytest.approx(
        [series.time[300], *(1e3 * series.platform[300, :2])], abs=1e-4
    )
    assert len(rows) == len(series.time)


def test_a_slow_passage_takes_a_hundred_times_as_long(
    runs: tuple[RunDirectory, RunDirectory], open_page: OpenPage
) -> None:
    page = opened(open_page, runs[0].page)
    page.select_option("#replay-speed", "0.01")
    page.evaluate("replay.seek(0.49)")
    assert page.evaluate("replay.pace()") == 0.01
    page.check("#replay-slow")
    assert page.evaluate("replay.pace()") == pytest.approx(0.001)


def test_it_obeys_the_keyboard(runs: tuple[RunDirectory, RunDirectory], open_page: OpenPage) -> None:
    page = opened(open_page, runs[0].page)
    page.keyboard.press("End")
    assert page.evaluate("replay.time") == 2.0
    page.keyboard.press("ArrowLeft")
    assert page.evaluate("replay.time") == pytest.approx(1.998, abs=1e-6)
    page.keyboard.press("Home")
    page.keyboard.press("ArrowRight")
    assert page.evaluate("replay.time") == pytest.approx(0.002, abs=1e-6)
    page.keyboard.press("Space")
    until(page, "replay.playing && replay.time > 0.01")
    page.keyboard.press("Space")
    assert not page.evaluate("replay.playing")
    page.focus("#replay-play")
    page.keyboard.press("Enter")
    assert page.evaluate("replay.playing")


def test_charts_share_their_time_axis(runs: tuple[RunDirectory, RunDirectory], open_page: OpenPage) -> None:
    page = opened(open_page, runs[0].page)
    page.evaluate("replay.charts.plots[0].x_range.setv({ start: 0.4, end: 0.6 })")
    assert page.evaluate("replay.charts.plots.map(plot => plot.x_range.start)") == [0.4] * 4


def test_a_fault_appears_when_its_time_has_come(runs: tuple[RunDirectory, RunDirectory], open_page: OpenPage) -> None:
    page = opened(open_page, runs[1].page)
    page.evaluate("replay.seek(1.398)")
    assert not page.is_visible("#replay-fault")
    page.evaluate("replay.seek(1.4)")
    assert page.is_visible("#replay-fault")
    assert page.text_content("#replay-fault") == f"1.400 s: {FAULT}"


def test_two_runs_move_together(runs: tuple[RunDirectory, RunDirectory], open_page: OpenPage) -> None:
    path, _ = write_overlay(*runs)
    page, series = opened(open_page, path), series_of(runs[0])
    assert page.locator("#replay-values th[scope=col]").all_text_contents() == ["run 1", "run 2"]
    page.evaluate("replay.seek(1.0)")
    first, second = page.evaluate("replay.stage.drawn.map(robot => robot.joints[2])")
    assert first == second == pytest.approx((1e3 * series.platform[500, :2]).tolist(), abs=0.01)
    page.evaluate("replay.seek(2.0)")
    first, second = page.evaluate("replay.stage.drawn.map(robot => robot.joints[2])")
    assert first == pytest.approx((1e3 * series.platform[1000, :2]).tolist(), abs=0.01)
    assert second == pytest.approx((1e3 * series.platform[700, :2]).tolist(), abs=0.01)


@pytest.mark.parametrize(
    ("name", "width", "height", "dark"),
    [("replay", 1100, 1150, False), ("replay_dark", 1100, 1150, True), ("replay_narrow", 390, 1700, False)],
)
def test_it_looks_like_the_picture_in_the_documentation(
    runs: tuple[RunDirectory, RunDirectory], open_page: OpenPage, name: str, width: int, height: int, dark: bool
) -> None:
    page = opened(open_page, runs[0].page, width=width, height=height, dark=dark)
    page.evaluate("replay.seek(0.52)")
    # what Bokeh paints comes with the next frames
    until(page, "Bokeh.documents[0].is_idle")
    page.evaluate("new Promise(done => requestAnimationFrame(() => requestAnimationFrame(done)))")
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert_looks_like(page, "#replay-player", name)
