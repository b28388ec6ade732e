# SPDX-License-Identifier: Apache-2.0
"""The report that a run leaves behind: figures, page and summary, whatever the run came to."""

from __future__ import annotations

import io
import json
import re
import shutil
import struct
from collections.abc import Iterator
from dataclasses import replace
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from fivebar_bringup.bag import serialize
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.bag.writer import BagWriter
from fivebar_bringup.errors import BagError
from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.style import BLUE, VERMILION, house_style, new_figure, png
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory
from fivebar_bringup.recorded.series import read_series
from fivebar_bringup.recorded.summary import CycleTime, Summary, summarize
from fivebar_bringup.recorded.timing import RunTiming
from fivebar_bringup.report import figures
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.animation import animate
from fivebar_bringup.report.gallery import REPLAYED, draw
from fivebar_bringup.report.outcome_words import mode_changes
from fivebar_bringup.report.page import html_page
from fivebar_bringup.report.report import read_analysis, write_report
from fivebar_bringup.report.thesis import counterpart, thesis_figures
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import OfflineRun, simulate, write_bag
from fivebar_bringup.units import engineering, plain, suitable_unit
from fivebar_control.model.geometry import inverse_geometry
from fivebar_description.interface import FAULTS, JOINT_STATES, JOINTS, TOPICS, sample_stamp_ns
from fivebar_description.strict_yaml import InputError

FIGURES = {
    "hero": (2100, 840),
    "torques": (1500, 900),
    "vhc_error": (1500, 900),
    "path": (1500, 900),
    "supervisor": (1500, 1140),
    "criterion": (1500, 660),
    "tracking": (1500, 660),
    "acceleration": (1500, 660),
}
"""Every figure with its width and height in pixels."""

MALICE = """"><script>alert('1')</script><img src='http://evil.example/x'>&"""


def without_scripts(page: str) -> str:
    """The page without what its scripts and their data say."""
    return re.sub(r"(<script[^>]*>).*?</script>", r"\1</script>", page, flags=re.DOTALL)


class Tags(HTMLParser):
    """Collects the tags and attributes of a page."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.open: list[str] = []
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs
        if tag not in ("meta", "img", "input"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def assert_picture(data: bytes, width: int, height: int) -> None:
    """Check that these are the bytes of a picture of this size with something in it."""
    assert data[:8] == b"\x89PNG\r\n\x1a\n"
    assert struct.unpack(">II", data[16:24]) == (width, height)
    assert len(data) > 20_000


def new_run(tmp_path: Path, scenario: Scenario, run: OfflineRun | None = None) -> RunDirectory:
    directory = new_run_directory(tmp_path / "run", scenario)
    if run is not None:
        write_bag(run, scenario, directory.bag)
    return directory


def findings(run: RunDirectory) -> RunAnalysis:
    scenario, recording = run.read_scenario(), read_bag(run.bag)
    series = read_series(recording, scenario)
    summary = summarize(recording, series, scenario, RunTiming())
    return RunAnalysis(scenario, scenario.plan(), scenario.five_bar(), series, summary)


@pytest.fixture
def coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    """Figures of few pixels, which take a third less time, where nobody looks at them."""
    monkeypatch.setattr("fivebar_bringup.pages.style.DPI", 20)


@pytest.fixture(scope="module")
def middle_run() -> OfflineRun:
    """The middle crossing, simulated once."""
    return simulate(load_scenario("middle"))


@pytest.fixture(scope="module")
def reported(
    tmp_path_factory: pytest.TempPathFactory, middle_run: OfflineRun
) -> Iterator[tuple[RunDirectory, Summary]]:
    """The middle crossing with its report, written once."""
    run = new_run(tmp_path_factory.mktemp("middle"), load_scenario("middle"), middle_run)
    run.timing.write_text('{"runner": "offline", "mode": null, "wall_s": 0.5, "overruns": null, "faults": []}')
    yield run, write_report(run)


def test_the_middle_run_succeeded(reported: tuple[RunDirectory, Summary]) -> None:
    _, summary = reported
    assert summary.outcome == RunOutcome.SUCCEEDED
    assert summary.assembly_mode_changes == 2
    assert summary.sigma_max == 1.0
    assert (summary.runner, summary.wall_s) == ("offline", 0.5)


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_is_a_picture(reported: tuple[RunDirectory, Summary], name: str) -> None:
    run, _ = reported
    assert_picture((run.figures / f"{name}.png").read_bytes(), *FIGURES[name])


def test_there_are_no_other_files(reported: tuple[RunDirectory, Summary]) -> None:
    run, _ = reported
    assert {path.name for path in run.figures.iterdir()} == {f"{name}.png" for name in FIGURES}
    assert {path.name for path in run.path.iterdir()} == {
        "bag", "figures", "report.html", "scenario.yaml", "summary.json", "timing.json",
    }  # fmt: skip


def test_the_summary_file_is_the_summary(reported: tuple[RunDirectory, Summary]) -> None:
    run, summary = reported

    def refuse(constant: str) -> float:
        raise AssertionError(f"{constant} is not JSON")

    assert json.loads(run.summary.read_text(encoding="utf-8"), parse_constant=refuse) == json.loads(
        json.dumps(summary.as_dict(), allow_nan=False)
    )


def test_the_page_asks_nothing_of_the_network(reported: tuple[RunDirectory, Summary]) -> None:
    run, _ = reported
    page = run.page.read_text(encoding="utf-8")
    assert not re.search(r"https?://|//[a-z]+\.|url\(|@import", without_scripts(page))
    tags = Tags(page)
    assert tags.open == []
    assert not {"link", "iframe", "object", "a"} & set(tags.tags)
    sources = [value for name, value in tags.attributes if name in ("src", "href", "srcset", "data")]
    assert len(sources) == len(FIGURES.keys() - REPLAYED)
    assert all(value is not None and value.startswith("data:image/png;base64,") for value in sources)


def test_the_page_names_no_place_of_this_machine(reported: tuple[RunDirectory, Summary]) -> None:
    run, _ = reported
    assert str(run.path.parent) not in run.page.read_text(encoding="utf-8")


def test_the_page_says_what_came_out(reported: tuple[RunDirectory, Summary]) -> None:
    run, _ = reported
    page = without_scripts(run.page.read_text(encoding="utf-8"))
    for text in (
        "The run succeeded",
        "no fault",
        "of order 1e-4",
        "segment_duration: 1.0",
        "fivebar simulate scenario.yaml",
        "figure 4.9",
    ):
        assert text in page, text
    assert "<title>middle: succeeded</title>" in page
    assert "None" not in page and "nan" not in re.sub(r'src="[^"]*"', "", page)


@pytest.mark.extra
def test_a_second_report_is_the_same(reported: tuple[RunDirectory, Summary], tmp_path: Path) -> None:
    run = RunDirectory(Path(shutil.copytree(reported[0].path, tmp_path / "again")))
    first = {path: path.read_bytes() for path in (run.page, run.summary)}
    write_report(run)
    assert {path: path.read_bytes() for path in first} == first


def test_the_page_leaves_out_what_the_run_does_not_have_and_tells_known_odds(
    reported: tuple[RunDirectory, Summary],
) -> None:
    summary = reported[1]
    assert summary.estimate_error_max_m is None and summary.odds is None
    page = html_page(load_scenario("middle"), summary, [])
    assert "<td>–</td>" not in page and "drawn robots" not in page
    odds = {"successes": 21, "robots": 24, "interval_95": (0.68, 0.97)}
    assert "21 of 24" in html_page(load_scenario("middle"), replace(summary, odds=odds), [])
    told = [{"goal": [0.0, 0.02], "odds": odds}, {"goal": [0.0, 0.1], "odds": {"unknown": "no time was left"}}]
    page = html_page(load_scenario("middle"), replace(summary, requested_odds=told), [])
    assert "to (0.0000, 0.0200) m 21 of 24; to (0.0000, 0.1000) m not known" in page


def test_times_between_samples_are_those_of_a_run_by_the_clock(reported: tuple[RunDirectory, Summary]) -> None:
    _, summary = reported
    for mode, told in (("lockstep", False), ("realtime", True)):
        page = html_page(
            load_scenario("middle"), replace(summary, mode=mode, cycle_time_ms=CycleTime(2.0, 2.1, 9.0)), []
        )
        assert ("time between samples" in page, "samples late, samples missing" in page) == (told, told)
        assert "samples missing" in page


def test_changes_are_counted_in_the_singular_and_the_plural() -> None:
    assert mode_changes(1) == "1 change of assembly mode"
    assert mode_changes(2, 1) == "2 changes of assembly mode and 1 of working mode"


def test_the_trail_of_the_moving_picture_has_the_colours_of_the_assembly_modes(
    reported: tuple[RunDirectory, Summary],
) -> None:
    picture = Image.open(io.BytesIO(animate(read_analysis(reported[0]), "gif")))
    picture.seek(picture.n_frames - 1)
    pixels = np.asarray(picture.convert("RGB"), dtype=int).reshape(-1, 3)
    width = picture.size[0]
    plan = pixels.reshape(-1, width, 3)[:, : width // 2]
    for colour in (BLUE, VERMILION):
        wanted = [int(colour[at : at + 2], 16) for at in (1, 3, 5)]
        assert np.count_nonzero(np.abs(plan - wanted).max(axis=2) < 24) > 50


def test_everything_on_the_page_is_escaped(reported: tuple[RunDirectory, Summary]) -> None:
    """A scenario cannot have such a name, a fault can have any text; the page trusts neither."""
    _, summary = reported
    scenario = load_scenario("middle").model_copy(update={"name": MALICE, "robot": MALICE})
    hostile: dict[str, Any] = {"controller": MALICE, "runner": MALICE, "mode": MALICE}
    changed = Summary(**{**vars(summary), **hostile, "not_completed_because": [MALICE]})
    page = html_page(scenario, changed, [Picture(MALICE, MALICE, b"png")])  # without a replay, so without scripts
    tags = Tags(page)
    assert tags.open == []
    assert "script" not in tags.tags
    assert tags.tags.count("img") == 1
    assert [value for name, value in tags.attributes if name == "src"] == ["data:image/png;base64,cG5n"]
    assert page.count("&lt;script&gt;") >= 6


def test_a_failed_run_says_why(tmp_path: Path, middle_run: OfflineRun) -> None:
    """Cut after 300 samples, as when the plant has diverged."""
    cut = OfflineRun(middle_run.samples[:300], ["plant_diverged: after sample 299: too <fast>"])
    run = new_run(tmp_path, load_scenario("middle"), cut)
    summary = write_report(run)
    assert summary.outcome == RunOutcome.STOPPED
    assert summary.assembly_mode_changes == 1
    page = run.page.read_text(encoding="utf-8")
    assert '<div class="verdict failed"><strong>The run was stopped</strong>, because<ul>' in page
    assert "<title>middle: stopped</title>" in page
    assert "<li>plant_diverged: after sample 299: too &lt;fast&gt;</li>" in page
    assert "<li>300 of the 1001 planned samples were recorded</li>" in page
    for name, size in FIGURES.items():
        assert_picture((run.figures / f"{name}.png").read_bytes(), *size)


@pytest.mark.extra
@pytest.mark.usefixtures("coarse")
def test_a_run_of_one_sample_has_a_report(tmp_path: Path, middle_run: OfflineRun) -> None:
    summary = write_report(new_run(tmp_path, load_scenario("middle"), OfflineRun(middle_run.samples[:1], [])))
    assert (summary.samples, summary.outcome, summary.simulated_s) == (1, "stopped", 0.0)


def test_a_run_that_never_began_has_a_report_without_pictures(tmp_path: Path) -> None:
    run = new_run(tmp_path, load_scenario("middle"))
    with BagWriter(run.bag, TOPICS) as bag:
        bag.write(FAULTS, 1, serialize.string("nodes_missing: not ready within 20 s: blender"))
    summary = write_report(run)
    assert (summary.samples, summary.outcome, summary.faults) == (0, "refused", ["nodes_missing"])
    assert list(run.figures.iterdir()) == []
    assert "holds no sample" in run.page.read_text(encoding="utf-8")


@pytest.mark.extra
@pytest.mark.usefixtures("coarse")
def test_a_bag_of_nothing_but_joint_states_has_a_report(tmp_path: Path) -> None:
    """As when someone recorded one topic by hand; every other series is NaN throughout."""
    scenario = load_scenario("middle")
    run = new_run(tmp_path, scenario)
    with BagWriter(run.bag, [JOINT_STATES]) as bag:
        for sample in range(0, 400, 3):
            stamp = sample_stamp_ns(sample, scenario.rate_hz)
            position = inverse_geometry(scenario.five_bar(), (1, -1), 0.0, 0.15 - 1e-4 * sample)
            bag.write(JOINT_STATES, stamp, serialize.joint_state(stamp, JOINTS, position, (0.0,) * 4))
    summary = write_report(run)
    assert summary.torque_peak_nm == (None, None)
    assert summary.outcome == RunOutcome.STOPPED


@pytest.mark.extra
@pytest.mark.usefixtures("coarse")
def test_undefined_joints_do_not_stop_the_report(tmp_path: Path) -> None:
    """A lost robot's bridge may publish NaN."""
    scenario = load_scenario("middle")
    run = new_run(tmp_path, scenario)
    with BagWriter(run.bag, [JOINT_STATES]) as bag:
        for sample in range(20):
            stamp = sample_stamp_ns(sample, scenario.rate_hz)
            values = (float("nan"),) * 4
            bag.write(JOINT_STATES, stamp, serialize.joint_state(stamp, JOINTS, values, values, values))
    assert write_report(run).outcome == RunOutcome.STOPPED


@pytest.mark.extra
@pytest.mark.parametrize(("torque", "scale"), [(0.5, "linear"), (99.0, "linear"), (101.0, "symlog"), (3e6, "symlog")])
def test_large_torques_get_a_logarithmic_axis(
    reported: tuple[RunDirectory, Summary], torque: float, scale: str
) -> None:
    """A peak must neither be cut off nor hide the rest."""
    run = findings(reported[0])
    applied = run.series.torque_applied.copy()
    applied[500, 0] = -torque
    series = type(run.series)(**{**vars(run.series), "torque_applied": applied})
    with house_style():
        axes = figures.torques(run._replace(series=series)).axes[0]
    assert axes.get_yscale() == scale
    low, high = axes.get_ylim()
    assert low < -torque and high > 0.5
    shown = [tick for tick in axes.get_yticks() if low <= tick <= high]
    assert 4 <= len(shown) <= 9


def test_what_was_asked_is_drawn_where_the_drives_gave_less(reported: tuple[RunDirectory, Summary]) -> None:
    run = findings(reported[0])
    with house_style():
        usual = [line.get_label() for line in figures.torques(run).axes[0].lines]
        limited = type(run.series)(
            **{**vars(run.series), "torque_applied": np.clip(run.series.torque_applied, -0.2, 0.2)}
        )
        cut = [line.get_label() for line in figures.torques(run._replace(series=limited)).axes[0].lines]
    assert "requested" not in usual
    assert "requested" in cut


def test_a_directory_without_a_run_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"is not a run directory: it has no scenario\.yaml"):
        write_report(RunDirectory(tmp_path))


def test_a_run_without_a_bag_is_refused(tmp_path: Path) -> None:
    with pytest.raises(BagError, match="no such directory"):
        write_report(new_run(tmp_path, load_scenario("middle")))


def test_a_damaged_bag_is_refused_and_leaves_no_half_report(tmp_path: Path, middle_run: OfflineRun) -> None:
    run = new_run(tmp_path, load_scenario("middle"), OfflineRun(middle_run.samples[:50], []))
    (data,) = run.bag.glob("*.mcap")
    data.write_bytes(data.read_bytes()[:2000])
    with pytest.raises(BagError) as error:
        write_report(run)
    assert "\n" not in str(error.value)
    assert not run.summary.exists()


@pytest.mark.usefixtures("coarse")
def test_a_report_that_cannot_be_written_is_refused_in_one_line(tmp_path: Path, middle_run: OfflineRun) -> None:
    run = new_run(tmp_path, load_scenario("middle"), OfflineRun(middle_run.samples[:5], []))
    run.figures.write_text("in the way")
    with pytest.raises(InputError, match="cannot be used for the results: ") as error:
        write_report(run)
    assert "\n" not in str(error.value)


def test_a_moved_run_can_be_reported(tmp_path: Path, middle_run: OfflineRun) -> None:
    run = new_run(tmp_path, load_scenario("middle"), OfflineRun(middle_run.samples[:50], []))
    moved = RunDirectory(Path(shutil.move(run.path, tmp_path / "elsewhere")))
    assert write_report(moved, with_page=False).samples == 50


@pytest.mark.parametrize(
    ("scenario", "torque", "order"),
    [
        ("middle", "figures 4.8 and 4.13", "of order 1e-4"),
        ("multiple", "figures 4.11 and 4.16", "of order 1e-3"),
        ("ctc_middle", "figure 4.8, there for another controller", None),
    ],
)
def test_runs_are_set_beside_the_figures_of_the_thesis(scenario: str, torque: str, order: str | None) -> None:
    loaded = load_scenario(scenario)
    assert counterpart(loaded).torque == torque
    assert thesis_figures(loaded).vhc_error == order


def test_another_motion_is_not_passed_off_as_one_of_the_thesis() -> None:
    other = load_scenario("middle").model_copy(update={"waypoints": ((0.0, 0.15), (0.0, 0.12))})
    assert counterpart(other).path == "figures 4.5 and 4.10, there for other motions"
    assert not any(thesis_figures(other))


@pytest.mark.parametrize(
    ("value", "unit", "text"),
    [
        (None, "m", "–"),
        (0.0, "m", "0 m"),
        (1.3463e-6, "m", "1.35 µm"),
        (0.0009996, "m", "1.00 mm"),
        (0.0123, "m", "12.3 mm"),
        (2465.8, "Nm", "2.47 kNm"),
        (3145193.0, "Nm", "3.15 MNm"),
        (2e-13, "m", "2e-13 m"),
    ],
)
def test_figures_are_worded_with_a_prefix(value: float | None, unit: str, text: str) -> None:
    assert engineering(value, unit) == text


@pytest.mark.parametrize(
    ("value", "text"), [(None, "–"), (0.5475, "0.547 Nm"), (12.0, "12.0 Nm"), (345.6, "346 Nm"), (1500.0, "1.50 kNm")]
)
def test_torques_are_worded_in_nm(value: float | None, text: str) -> None:
    assert plain(value, "Nm") == text


def test_axes_get_a_unit_that_suits() -> None:
    assert suitable_unit(2e-5, "m") == (pytest.approx(1e6), "µm")
    assert suitable_unit(0.0, "rad") == (1.0, "rad")
    assert suitable_unit(None, "rad") == (1.0, "rad")


@pytest.mark.extra
def test_a_run_in_real_time_shows_its_cycle_times(reported: tuple[RunDirectory, Summary]) -> None:
    run, _ = reported
    analysis = findings(run)
    series = analysis.series
    clocked = replace(analysis.summary, mode="realtime", overruns=3, cycle_time_ms=CycleTime(2.0, 2.1, 9.0))
    uneven = replace(series, log_time_ns=series.log_time_ns + 300_000 * (series.sample % 7))
    assert_picture(draw(analysis._replace(series=uneven, summary=clocked), "cycles"), 1500, 660)


def test_a_picture_is_drawn_once(monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[Figure] = []
    draw = Figure.draw
    monkeypatch.setattr(Figure, "draw", lambda figure, renderer: (drawn.append(figure), draw(figure, renderer)))
    figure = new_figure("title", "subtitle", 3.0)
    figure.add_subplot().plot([0.0, 1.0], [0.0, 2.0])
    picture = png(figure)
    assert drawn == [figure]
    saved = io.BytesIO()
    figure.savefig(saved, format="png", metadata={"Software": None})
    assert picture == saved.getvalue()
