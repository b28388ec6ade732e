# SPDX-License-Identifier: Apache-2.0
"""The reproduction: its rules with numbers beside them, its runs against their bags, and the page that it leaves."""

from __future__ import annotations

import json
import math
import re
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.cli.main import app
from fivebar_bringup.pages.content import Cell, Table
from fivebar_bringup.recorded.results import finite
from fivebar_bringup.recorded.series import read_series
from fivebar_bringup.recorded.summary import summarize
from fivebar_bringup.recorded.timing import RunTiming
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.criterion_figure import crossing_residuals, reference_residual
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import simulate, write_bag
from fivebar_bringup.simulation.run_in_memory import RunInMemory
from fivebar_description.camera import NO_CAMERA, CameraSettings
from fivebar_description.scenario_file import shipped_scenarios
from fivebar_description.strict_yaml import InputError
from fivebar_studies.engine.running import run_study
from fivebar_studies.reproduce import tables
from fivebar_studies.reproduce.cases import FULL, QUICK, VARIANTS, ReproductionCase
from fivebar_studies.reproduce.claims import CLAIMS, ClaimRow
from fivebar_studies.reproduce.free_dynamics import free_dynamics, rotated
from fivebar_studies.reproduce.joint_law import OBLIQUE, shares_as_printed
from fivebar_studies.reproduce.measured import largest
from fivebar_studies.reproduce.reproduce import REPRODUCTION, html_page
from fivebar_studies.reproduce.runner import ReproductionResult, ReproductionRow, result_of, run_case
from fivebar_studies.reproduce.verdicts import (
    Judgement,
    PairedRuns,
    Verdict,
    as_printed,
    counted,
    finite_torque,
    more_accurate,
    near_noise,
    only_one_side_finite,
    order_of_magnitude,
    quartiles,
    shown_necessary,
    shown_unnecessary,
    some_fail,
    some_not_across,
    some_setting_works,
    undecided,
    vanishing,
    within,
)

AGREED, BETTER, NOT = Verdict.AGREED, Verdict.BETTER, Verdict.NOT_REPRODUCED


@pytest.mark.parametrize(
    ("measured", "verdict"),
    [(1e-6, BETTER), (3.1e-5, BETTER), (3.2e-5, AGREED), (1e-4, AGREED), (3.1e-4, AGREED), (3.2e-4, NOT), (None, NOT)],
)
def test_an_order_reaches_half_a_decade_up_and_down(measured: float | None, verdict: Verdict) -> None:
    assert order_of_magnitude(measured, 1e-4, "m").verdict == verdict


@pytest.mark.parametrize(
    ("completed", "peaks", "verdict"),
    [
        ([True, True], [0.5, 10.0], AGREED),
        ([True, True], [0.5, 10.1], NOT),
        ([True, False], [0.5, 0.5], NOT),
        ([True], [None], NOT),
        ([], [], NOT),
    ],
)
def test_finite_means_completed_within_the_drives(
    completed: list[bool], peaks: list[float | None], verdict: Verdict
) -> None:
    assert finite_torque(completed, peaks).verdict == verdict


def test_computed_torque_has_to_ask_for_too_much_every_time() -> None:
    good, bad = finite_torque([True], [1.0]), finite_torque([False], [1.0])
    assert only_one_side_finite(good, [300.0, None]).verdict == AGREED
    assert only_one_side_finite(good, [300.0, 9.0]).verdict == NOT
    assert only_one_side_finite(bad, [300.0]).verdict == NOT
    assert only_one_side_finite(good, []).verdict == NOT


def test_every_run_has_to_count_the_same() -> None:
    assert counted([2, 2], 2, "changes").verdict == AGREED
    assert counted([2, 1], 2, "changes").verdict == NOT
    assert counted([], 2, "changes").verdict == NOT


def test_zero_is_zero_against_the_forces_there_are() -> None:
    assert vanishing(1e-9, 1.0, 1e-9, "N").verdict == AGREED
    assert vanishing(1.1e-9, 1.0, 1e-9, "N").verdict == NOT
    assert vanishing(0.0, 0.0, 1e-9, "N").verdict == NOT  # nothing was tried


def test_printed_results_are_compared_entry_by_entry() -> None:
    assert as_printed(9e-4, 1e-3).verdict == AGREED
    assert as_printed(1.64, 1e-3).verdict == NOT


def test_what_cannot_decide_does_not_agree_but_can_contradict() -> None:
    judged = undecided(within([1e-3], 2e-3), "the thesis has no result")
    assert judged.verdict == Verdict.UNDECIDED and judged.reason.endswith("; the thesis has no result")
    assert undecided(within([3e-3], 2e-3), "the thesis has no result") == within([3e-3], 2e-3)


def pair(completed_without: bool = True, error_without: float | None = 1.5e-4) -> PairedRuns:
    return PairedRuns("run", True, completed_without, 1e-4, error_without)


@pytest.mark.parametrize(
    ("without", "verdict"),
    [
        (pair(), NOT),  # 1.5 times the error
        (pair(error_without=3.1e-4), NOT),
        (pair(error_without=3.2e-4), AGREED),
        (pair(completed_without=False), AGREED),
        (pair(error_without=None), AGREED),
    ],
)
def test_a_measure_is_necessary_where_something_is_lost_without_it(without: PairedRuns, verdict: Verdict) -> None:
    assert shown_necessary([pair(), without]).verdict == verdict


def test_a_run_lost_with_and_without_a_measure_shows_no_need() -> None:
    assert shown_necessary([PairedRuns("lost", False, False, 1e-2, 1e-2)]).verdict == NOT


def test_a_measure_is_unnecessary_where_nothing_is_lost_without_it() -> None:
    assert shown_unnecessary([True, True], [3e-4, 1e-6], 1e-4, "m").verdict == AGREED
    assert shown_unnecessary([True, True], [3.2e-4, 1e-6], 1e-4, "m").verdict == NOT
    assert shown_unnecessary([True, False], [1e-6], 1e-4, "m").verdict == NOT
    assert shown_unnecessary([True], [None], 1e-4, "m").verdict == NOT


def test_accuracy_is_judged_by_the_median_run_and_by_the_stiffness_as_printed() -> None:
    assert more_accurate([1.0, 1.1, 9.0], [1.0]).verdict == AGREED
    assert more_accurate([1.0, 1.09, 9.0], [1.1, 0.9]).verdict == NOT
    assert more_accurate([1.0, 1.09, 9.0], [1.1, 0.89]).verdict == AGREED
    assert more_accurate([], []).verdict == NOT


def test_as_printed_the_joint_law_does_not_hold_an_oblique_crossing() -> None:
    """The middle crossing, there and back, nearly with its gain; the oblique one is pushed away from its path."""
    assert shares_as_printed(load_scenario("middle")) == pytest.approx([1.040, 0.960], abs=1e-3)
    (share,) = shares_as_printed(OBLIQUE)
    assert share == pytest.approx(-0.528, abs=1e-3)


def test_the_imu_may_see_a_fifth_more_than_noise() -> None:
    assert near_noise([1.0, 1.2], [1.1, 1.2]).verdict == AGREED
    assert near_noise([1.0, 1.21], [1.1, 1.2]).verdict == NOT
    assert near_noise([1.0, 1.2], [1.1, 1.21]).verdict == NOT
    assert near_noise([1.0], [None]).verdict == NOT


def test_an_accuracy_holds_for_every_error() -> None:
    assert within([1e-5, 5e-5], 5e-5).verdict == AGREED
    assert within([1e-5, 5.1e-5], 5e-5).verdict == NOT
    assert within([1e-5, None], 5e-5).verdict == NOT
    assert within([], 5e-5).verdict == NOT


@pytest.mark.extra
def test_the_camera_is_as_accurate_as_was_asked_for() -> None:
    (claim,) = (claim for claim in CLAIMS if claim.name == "vision in motion")
    row = claim.row(QUICK, {})
    # which is as far as it goes: the thesis has no result
    assert row.judgement.verdict == Verdict.UNDECIDED
    assert row.numbers["seen"] == row.numbers["pictures"]


def test_what_depends_on_where_a_sample_falls_is_given_by_its_quartiles() -> None:
    assert quartiles([4.0, None, 1.0, 2.0, 3.0, 100.0]) == (2.0, 3.0, 4.0)
    assert quartiles([None]) is None


def test_a_method_has_to_fail_on_one_side_only() -> None:
    assert some_fail(1, 8, 0, 8).verdict == AGREED
    assert some_fail(0, 8, 0, 8).verdict == NOT
    assert some_fail(3, 8, 1, 8).verdict == NOT


def test_a_method_that_always_gets_across_is_not_said_to_fail() -> None:
    assert some_not_across([True, True]).verdict == NOT
    assert some_not_across([True, False]).verdict == AGREED


def test_one_threshold_that_works_is_enough() -> None:
    assert some_setting_works({"0.02": (8, 8), "0.1": (4, 8)}).verdict == AGREED
    assert some_setting_works({"0.05": (7, 8), "0.1": (4, 8)}).verdict == NOT


def test_an_unknown_figure_may_be_the_largest() -> None:
    assert largest([1.0, 3.0]) == 3.0
    assert largest([1.0, None]) is None


@pytest.mark.extra
@pytest.mark.parametrize(
    ("case", "camera"),
    [
        (ReproductionCase(), NO_CAMERA),
        (ReproductionCase("ctc", duration=0.5), CameraSettings(on=True, pictures=False)),
        (ReproductionCase("multi_joint", "fig_3_2", 0.5, imu=True), NO_CAMERA),
    ],
    ids=["ctc and vhc", "camera", "imu"],
)
def test_a_run_in_memory_is_the_run_in_its_bag(case: ReproductionCase, camera: CameraSettings, tmp_path: Path) -> None:
    """Bit for bit, so that the figures of the page are those of the run's own report."""
    scenario = case.scenario().model_copy(update={"camera": camera})
    run = simulate(scenario)
    write_bag(run, scenario, tmp_path / "bag")
    from_bag, from_memory = read_bag(tmp_path / "bag"), RunInMemory(run, scenario)
    one, other = read_series(from_bag, scenario), read_series(from_memory, scenario)
    assert (one.vision.time.size > 0) is camera.on
    assert one.robot == other.robot
    recorded, kept = one.table.columns(), other.table.columns()
    assert recorded.keys() == kept.keys() >= {"q11_feedback", "xd_sent", "tau1_command", "sigma"}
    for name, values in recorded.items():
        np.testing.assert_array_equal(values, kept[name], err_msg=name)
    for name in vars(one).keys() - {"robot", "table"}:
        if name == "vision":
            for of_bag, of_memory in zip(one.vision, other.vision, strict=True):
                np.testing.assert_array_equal(of_bag, of_memory, err_msg=name)
        elif name != "log_time_ns":
            np.testing.assert_array_equal(getattr(one, name), getattr(other, name), err_msg=name)
    timing = RunTiming(runner="offline")
    assert summarize(from_bag, one, scenario, timing) == summarize(from_memory, other, scenario, timing)


def test_a_result_survives_its_row() -> None:
    result = run_case(ReproductionCase("ctc", duration=0.5), number=7)
    text = REPRODUCTION.table.lines([result.row])
    (row,) = REPRODUCTION.table.read(text)
    assert result_of(result.case, row, ()) == result


def test_a_lost_run_keeps_its_reasons() -> None:
    lost = ReproductionCase("ctc", "middle", 1.0, "friction × 1.2")
    result = run_case(lost)
    assert not result.completed
    assert "torque_excessive" in result.why_not
    assert tables.completed_cell(result).good is False


def test_a_refused_motion_is_a_result_too() -> None:
    result = run_case(ReproductionCase(motion="late", duration=0.01))
    assert result.summary is None
    assert result.why_not.startswith("refused: ")
    assert (result.requested, result.tracking_error, result.imu_ratio) == (None, None, None)


def test_the_criterion_time_law_meets_the_criterion_and_the_quintic_does_not() -> None:
    quintic = run_case(ReproductionCase("multi_model_ctc", "early", 0.3))
    criterion = run_case(ReproductionCase("multi_model_ctc", "early", 0.3, time_law="criterion"))
    assert quintic.row.crossing_residual_n == pytest.approx(2.033, abs=1e-3)
    residual = criterion.row.crossing_residual_n
    assert residual is not None and residual < 1e-9
    assert (quintic.row.least_fraction, quintic.row.largest_fraction) == pytest.approx((0.2413, 0.2413), abs=1e-4)
    assert quintic.requested is not None and criterion.requested is not None
    assert quintic.requested > 10.0 > 3.0 > criterion.requested


def test_the_residual_of_the_series_is_the_planned_one() -> None:
    scenario = ReproductionCase("multi_cartesian", "early", 0.5).scenario()
    run = simulate(scenario)
    series = read_series(RunInMemory(run, scenario), scenario)
    summary = summarize(RunInMemory(run, scenario), series, scenario, RunTiming())
    findings = RunAnalysis(scenario, scenario.plan(), scenario.five_bar(), series, summary)
    residual = reference_residual(findings)
    (crossing,) = findings.plan.crossings
    assert np.interp(crossing.time, series.time, residual) == pytest.approx(crossing_residuals(findings)[0], abs=1e-3)


def test_the_free_dynamics_are_the_criterion() -> None:
    found = free_dynamics([ReproductionCase(motion="middle"), ReproductionCase(motion="fig_3_2")])
    assert (found.states, found.torques) == (4, 40)
    assert found.along < 1e-11 < 10.0 < found.force
    # away from the locus it is no zero: in proportion to the distance
    growth = found.along_at_distance[-5] / found.along_at_distance[0]
    assert growth == pytest.approx(found.distance[-5] / found.distance[0], rel=0.5)


def test_3_45_holds_transposed_but_for_a_sign() -> None:
    found = rotated()
    assert found.difference_as_printed == pytest.approx(1.641, abs=1e-3)
    assert found.difference_transposed == pytest.approx(2.0, abs=1e-3)
    assert found.second_row < 2e-4


def test_the_posture_of_figure_3_2_is_crossed() -> None:
    crossings = load_scenario("fig_3_2").plan().crossings
    assert [(crossing.x, crossing.y) for crossing in crossings] == [pytest.approx((-0.06745, 0.03989), abs=1e-5)] * 2


@pytest.mark.parametrize("name", shipped_scenarios())
def test_shipped_scenarios_say_what_they_show(name: str) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    path = Path(__file__).parents[4] / "src/fivebar_description/config/scenarios" / f"{name}.yaml"
    assert path.read_text(encoding="utf-8").startswith("# ")


def test_claims_and_variants_have_names_of_their_own() -> None:
    assert len({claim.name for claim in CLAIMS}) == len(CLAIMS)
    assert len(VARIANTS) == 8
    for extent in (QUICK, FULL):
        for claim in CLAIMS:
            for case in claim.needs(extent):
                assert case.scenario().controller == case.controller


def test_another_robot_than_that_of_the_thesis_is_refused() -> None:
    called = CliRunner().invoke(app, ["reproduce", "--robot", "motkin"])
    assert called.exit_code == 2
    assert called.stderr.startswith("fivebar: --robot: 'motkin': expected dextar, ")


class Tags(HTMLParser):
    """Checks that tags are closed in order and collects what a page refers to."""

    def __init__(self, page: str) -> None:
        super().__init__()
        self.open: list[str] = []
        self.sources: list[str] = []
        self.names: set[str] = set()
        self.links: set[str] = set()
        self.feed(page)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        values = dict(attrs)
        self.sources += [values[name] or "" for name in ("src",) if name in values]
        if "id" in values:
            self.names.add(values["id"] or "")
        if "href" in values:
            self.links.add(values["href"] or "")
        if tag not in ("meta", "img"):
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def refuse(constant: str) -> float:
    raise AssertionError(f"{constant} is not JSON")


@pytest.mark.extra
def test_a_quick_reproduction_leaves_a_page_and_strict_json(tmp_path: Path) -> None:
    """Three rows, their runs in this process."""
    seen: list[tuple[int, int]] = []
    given = {"quick": True, "claims": ("4.8", "4.9", "3.45")}
    made = run_study(REPRODUCTION, given, tmp_path / "out", progress=lambda done, total: seen.append((done, total)))
    assert seen == [(0, 1), (1, 1)]
    assert [str(row.judgement.verdict) for row in made.shown] == ["not reproduced", "agreed", "better"]
    text = (tmp_path / "out" / "reproduce.json").read_text(encoding="utf-8")
    content = json.loads(text, parse_constant=refuse)
    assert content == json.loads(json.dumps(made.content))
    assert content["verdicts"] == {"agreed": 1, "better": 1, "not reproduced": 1, "undecided": 0}
    assert content["rows"][1]["numbers"]["torque_requested_max_nm"]["1 s"] == pytest.approx(0.554, abs=1e-3)
    page = made.page.read_text(encoding="utf-8")
    tags = Tags(page)
    assert tags.open == []
    assert {link.removeprefix("#") for link in tags.links} <= tags.names
    assert len(tags.sources) == 2
    assert all(source.startswith("data:image/png;base64,") for source in tags.sources)
    assert not re.search(r"https?://|@import|url\(", page)
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "figures",
        *(f"reproduce.{ending}" for ending in ("csv", "html", "json", "parquet", "schema.json")),
    }
    assert len(list((tmp_path / "out" / "figures").iterdir())) == 2


def test_results_do_not_overwrite_others(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    with pytest.raises(InputError, match="is not empty"):
        run_study(REPRODUCTION, {}, tmp_path)


def test_the_command_refuses_a_directory_in_use(tmp_path: Path) -> None:
    (tmp_path / "notes.txt").write_text("mine")
    done = CliRunner().invoke(app, ["reproduce", "--quick", "--json", "--out", str(tmp_path)])
    assert done.exit_code == 2
    assert "is not empty" in done.stderr
    assert done.stdout == ""


def test_the_tables_of_a_quick_reproduction_can_be_made() -> None:
    """With every run refused: nothing is known, nothing is completed, and nothing breaks."""
    cases = [*tables.crossing_cases(QUICK), *tables.comparison_cases(QUICK), *tables.far_cases()]
    cases += tables.imu_cases(QUICK)
    results = {case: ReproductionResult(case, ReproductionRow(0, case.label, "out of reach")) for case in cases}
    made = [
        tables.crossing_table(QUICK, results),
        tables.variants_table(QUICK, results),
        tables.printed_table(QUICK, results),
        tables.comparison_overview(QUICK, results),
        *tables.comparison_tables(QUICK, results),
        tables.far_table(results),
        tables.imu_table(QUICK, results),
    ]
    json.dumps([table.as_json() for table in made], allow_nan=False)
    assert all(len(row) == len(table.columns) for table in made for row in table.rows)
    assert Tags(html_page([], made, 0, "fivebar reproduce")).open == []


def test_what_comes_from_outside_is_escaped() -> None:
    malice = '"><script>alert(1)</script>'
    row = ClaimRow(malice, malice, malice, malice, {}, Judgement(NOT, malice, malice), malice)
    table = Table("name", malice, malice, (malice,), ((Cell(malice, 1),),))
    assert "<script" not in html_page([row], [table], 1, malice)


def test_numbers_that_json_lacks_become_null() -> None:
    assert finite({"a": (math.nan, 1.0), "b": [math.inf], "c": "x"}) == {"a": [None, 1.0], "b": [None], "c": "x"}


def test_the_joint_claims_of_the_model_need_no_run() -> None:
    names = ("1.17", "1.18", "appendix", "3.2", "3.45")
    assert [(claim.name, len(claim.needs(QUICK))) for claim in CLAIMS[:5]] == list(
        zip(names, (0, 0, 0, 1, 0), strict=True)
    )
    assert len(CLAIMS) == 29
