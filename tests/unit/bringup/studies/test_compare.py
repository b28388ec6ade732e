# SPDX-License-Identifier: Apache-2.0
"""The comparison: its rigs, its runs, its verdicts with numbers beside them, and what it leaves."""

from __future__ import annotations

import csv
import json
from pathlib import Path

import pytest
from typer.testing import CliRunner

from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.cli.main import app
from fivebar_bringup.recorded.outcome import RunOutcome
from fivebar_bringup.recorded.series import read_series
from fivebar_bringup.recorded.summary import summarize
from fivebar_bringup.recorded.timing import RunTiming
from fivebar_bringup.scenario import Scenario
from fivebar_bringup.scenarios.scenario_files import load_scenario
from fivebar_bringup.simulation.offline import simulate, write_bag
from fivebar_bringup.simulation.run_in_memory import RunInMemory
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_control.scenario.guard_settings import motor_torque_limit
from fivebar_control.trajectory.planner import PlanRefused
from fivebar_studies.compare.cases import (
    AS_GIVEN,
    COMPARED_RIGS,
    TIGHT_LIMIT,
    ComparisonCase,
    ComparisonExtent,
    default_rigs,
    scenario_on,
)
from fivebar_studies.compare.compare import COMPARISON, ComparisonSettings, cases_of, command_of, html_page
from fivebar_studies.compare.figures import compare_figures
from fivebar_studies.compare.results import ComparedRun, ComparisonRow, run_case
from fivebar_studies.compare.screening import quickest_durations
from fivebar_studies.compare.tables import overview_table, run_tables, tight_table
from fivebar_studies.compare.verdicts import findings, lost
from fivebar_studies.engine.running import run_study

MIDDLE = load_scenario("middle")


@pytest.mark.parametrize("rig", [*COMPARED_RIGS, AS_GIVEN])
@pytest.mark.parametrize("controller", CONTROLLERS)
def test_every_controller_has_a_scenario_on_every_rig(rig: str, controller: str) -> None:
    scenario = ComparisonCase(MIDDLE, controller, 0.5, rig).scenario()
    assert (scenario.controller, scenario.waypoints) == (controller, MIDDLE.waypoints)
    assert scenario.plan().path.duration == pytest.approx(1.0)
    assert scenario.plant.torque_limit == MIDDLE.plant.torque_limit


def test_the_realistic_rig_is_the_one_that_is_promised() -> None:
    scenario = ComparisonCase(MIDDLE, "unified", 1.0, "realistic").scenario()
    plant = scenario.plant
    assert (plant.encoder_counts, plant.torque_quantum, plant.delay_samples) == (20_000, 0.002, 1)
    assert (plant.mass_scale, plant.inertia_scale, plant.friction_scale) == (1.1, 0.9, 0.8)
    assert scenario.estimator == "ekf"
    assert 900.0 <= scenario.gains.kp <= 1600.0
    ideal = ComparisonCase(MIDDLE, "unified", 1.0, "ideal").scenario()
    assert (ideal.plant, ideal.gains, ideal.unified) == (MIDDLE.plant, MIDDLE.gains, MIDDLE.unified)


def test_a_rig_replaces_the_plant_of_the_scenario_but_not_its_limits() -> None:
    given = changed(plant={"torque_limit": 3.0, "seed": 7, "mass_scale": 1.3})
    plant = ComparisonCase(given, "ctc", 1.0, "wrong").scenario().plant
    assert (plant.torque_limit, plant.seed, plant.mass_scale, plant.friction_scale) == (3.0, 7, 1.1, 0.8)
    assert ComparisonCase(given, "ctc", 1.0, AS_GIVEN).scenario().plant == given.plant
    assert motor_torque_limit(ComparisonCase(given, "ctc", 1.0, "wrong", TIGHT_LIMIT).scenario()) == TIGHT_LIMIT
    modest = changed(plant={"torque_limit": 0.5})
    assert motor_torque_limit(ComparisonCase(modest, "ctc", 1.0, "ideal", TIGHT_LIMIT).scenario()) == 0.5


def test_a_scenario_with_a_plant_of_its_own_is_one_more_rig() -> None:
    assert default_rigs(MIDDLE) == COMPARED_RIGS
    assert default_rigs(load_scenario("middle_encoders")) == COMPARED_RIGS
    assert default_rigs(changed(plant={"mass_scale": 1.3})) == (*COMPARED_RIGS, AS_GIVEN)
    # the same plant, watched by nobody
    encoders = load_scenario("middle_encoders")
    assert default_rigs(changed(plant=encoders.plant._asdict())) == (*COMPARED_RIGS, AS_GIVEN)


def changed(**sections: object) -> Scenario:
    return Scenario.model_validate({**MIDDLE.model_dump(), **sections})


def test_what_is_run_under_the_tight_limit() -> None:
    extent = ComparisonExtent((MIDDLE,), ("unified", "ctc"), (0.5, 1.0), ("ideal", "realistic"))
    assert len(extent.asked) == 8
    tight = extent.tight
    assert {case.torque_limit for case in tight} == {TIGHT_LIMIT}
    asked = [(case.rig, case.duration) for case in tight if case.controller == "ctc"]
    assert asked == [("ideal", 0.5), ("ideal", 1.0), ("ideal", None), ("realistic", None)]


def test_the_quickest_pace_is_allowed_and_a_tenth_less_is_not() -> None:
    case = ComparisonCase(MIDDLE, "unified", None, "ideal", TIGHT_LIMIT)
    scenario = case.scenario()
    assert all(1.0 < duration < 1.5 for duration in scenario.durations())
    assert run_case(0, case).screen_says == ""
    quicker = [0.9 * duration for duration in scenario.durations()]
    hurried = Scenario.model_validate({**scenario.model_dump(), "segment_duration": tuple(quicker)})
    # on the ideal rig nothing else is refused than the torque
    says = run_case(0, ComparisonCase(hurried, "unified", quicker[0], AS_GIVEN)).screen_says
    assert says.startswith("reference torque") and ";" not in says


def test_only_straight_motions_have_a_quickest_pace() -> None:
    with pytest.raises(PlanRefused, match="fifth-order"):
        quickest_durations(changed(time_law="criterion"))


TOLD_APART = ("succeeded", "refused", "could not run")


def compared(case: ComparisonCase) -> ComparedRun:
    return ComparedRun(case, run_case(0, case))


def test_a_motion_that_a_controller_cannot_make_is_a_result() -> None:
    both = load_scenario("type2_and_type1")
    result, too_far = map(
        compared,
        (
            ComparisonCase(both, "multi_cartesian", 1.0, "ideal"),
            ComparisonCase(changed(waypoints=((0.0, 0.15), (0.0, 0.5))), "unified", 1.0, "ideal"),
        ),
    )
    assert not result.row.made
    assert not result.row.completed
    assert "multi_cartesian cannot meet Type 1" in result.row.why_not
    assert result.row.refused_by_screen is None
    assert [run.row.outcome for run in (result, too_far)] == [RunOutcome.COULD_NOT_RUN, RunOutcome.REFUSED]
    # the table tells them apart, and none of them counts as a failure
    overview = overview_table([result, too_far, made(rig="wrong")])
    told = [[row[overview.columns.index(one)].text for one in TOLD_APART] for row in overview.rows]
    assert told == [["–", "0", "1"], ["–", "1", "0"], ["1 of 1", "0", "0"]]
    assert "cannot meet Type 1" in overview.rows[0][-1].text
    nothing_ran = findings([result._replace(case=result.case._replace(controller="unified"))], [])[0]
    assert nothing_ran.met is None and nothing_ran.measured.startswith("nothing ran: ")


@pytest.mark.parametrize("rig", ["ideal", AS_GIVEN])
def test_settings_of_the_law_of_a_scenario_are_not_those_of_another_law(rig: str) -> None:
    given = changed(controller="toy_law:LAW", law={"ki": 7.0})
    kept, other = (ComparisonCase(given, name, 1.0, rig).scenario() for name in ("toy_law:LAW", "unified"))
    assert (kept.law, other.law) == ({"ki": 7.0}, {})


@pytest.fixture(scope="module")
def crossing() -> ComparedRun:
    """The quick crossing on the realistic rig."""
    return compared(ComparisonCase(MIDDLE, "unified", 0.5, "realistic"))


def test_a_run_on_the_realistic_rig_has_all_figures(crossing: ComparedRun) -> None:
    row = crossing.row
    assert row.completed
    assert 1e-5 < (row.tracking_error_rms_m or 0.0) < (row.tracking_error_peak_m or 0.0) < 0.8e-3
    assert 0.7 < (row.torque_peak_nm or 0.0) < 1.5
    assert (row.margin_nm or 0.0) + (row.torque_peak_nm or 0.0) == pytest.approx(10.0)
    assert row.margin_share == pytest.approx((row.margin_nm or 0.0) / 10.0)
    assert (row.torque_saturated_samples, row.samples_at_limit) == (0, 0)
    assert 0.0 < (row.net_work_j or 0.0) < (row.energy_j or 0.0) < 2.0
    assert None not in row


def test_an_estimated_run_in_memory_is_what_its_bag_holds(tmp_path: Path) -> None:
    scenario = ComparisonCase(MIDDLE, "multi_cartesian", 0.3, "realistic").scenario()
    run = simulate(scenario)
    write_bag(run, scenario, tmp_path / "bag")
    summaries = []
    for recording in (read_bag(tmp_path / "bag"), RunInMemory(run, scenario)):
        summaries.append(summarize(recording, read_series(recording, scenario), scenario, RunTiming()))
    assert summaries[0].estimate_error_max_m is not None
    assert summaries[0] == summaries[1]


def made(
    controller: str = "unified", rig: str = "ideal", duration: float | None = 1.0, **figures: object
) -> ComparedRun:
    """A run that nobody made, of figures within the bounds."""
    done = figures.get("completed", True)
    usual = {
        "completed": done,
        "outcome": RunOutcome.SUCCEEDED if done else RunOutcome.STOPPED,
        "refused_by_screen": False,
        "tracking_error_peak_m": 0.3e-3,
        "torque_peak_nm": 0.9,
        "torque_limit_nm": 10.0,
        "torque_saturated_samples": 0,
        "margin_nm": 9.1,
    }
    row = ComparisonRow(0, "middle", rig, controller, duration, **{**usual, **figures})  # type: ignore[arg-type]
    return ComparedRun(ComparisonCase(MIDDLE, controller, duration, rig), row)


@pytest.mark.parametrize(
    ("rig", "figures", "met"),
    [
        ("ideal", {}, True),
        ("ideal", {"tracking_error_peak_m": 0.41e-3}, False),
        ("ideal", {"torque_peak_nm": 1.01}, False),
        ("ideal", {"completed": False}, False),
        ("ideal", {"tracking_error_peak_m": None}, False),
        ("realistic", {"tracking_error_peak_m": 0.79e-3, "torque_peak_nm": 1.49}, True),
        ("realistic", {"tracking_error_peak_m": 0.81e-3}, False),
        ("realistic", {"torque_peak_nm": 1.51}, False),
    ],
)
def test_the_bounds_decide(rig: str, figures: dict[str, object], met: bool) -> None:
    others = [made("ctc", rig, tracking_error_peak_m=1.0), made(rig="encoders", torque_peak_nm=5.0)]
    judged = {
        finding.title: finding.met for finding in findings([made(rig=rig), made(rig=rig, **figures), *others], [])
    }
    assert judged.pop(f"unified on the rig {rig}") is met
    assert set(judged.values()) == {None}


def test_a_verdict_states_where_the_worst_was() -> None:
    quick = made(duration=0.5, tracking_error_peak_m=0.2e-3, torque_peak_nm=0.95)
    finding = findings([made(), quick], [])[0]
    assert finding.measured == "2 of 2 completed, 300 µm (middle 1 s), 0.950 Nm (middle 0.5 s)"


REFUSED = {"screen_says": "reference torque is 0.9 Nm"}


@pytest.mark.parametrize(
    ("asked", "slowed", "met"),
    [
        ({**REFUSED, "completed": False}, {}, True),
        ({**REFUSED, "tracking_error_peak_m": 5e-3}, {}, True),
        ({}, {}, True),
        ({"completed": False}, {}, False),
        ({"tracking_error_peak_m": 5e-3}, {}, False),
        (REFUSED, {"completed": False}, False),
        (REFUSED, {"tracking_error_peak_m": 5e-3}, False),
    ],
)
def test_the_screen_has_to_see_what_the_limit_does_not_save(
    asked: dict[str, object], slowed: dict[str, object], met: bool
) -> None:
    tight = [made(duration=0.5, **asked), made(duration=None, **slowed), made("ctc", duration=0.5, completed=False)]
    assert findings([], tight)[-1].met is met


def test_no_verdict_is_passed_on_what_cannot_be_run() -> None:
    """Neither an estimator in several working modes, nor a quickest pace there, nor less torque than drives have."""
    extent = ComparisonExtent((load_scenario("type1_working_mode"),), ("unified",), (1.0,))
    assert {case.rig for case in extent.asked} == {"ideal", "wrong"}
    assert extent.tight == []
    weak = ComparisonExtent((changed(plant={"torque_limit": 0.5}),), ("unified",), (1.0,))
    assert weak.tight == []
    small = ComparisonExtent((load_scenario("motkin_middle"),), ("unified",), (1.0,)).tight
    assert [case.torque_limit for case in small] == [pytest.approx(0.035 / 0.55 * TIGHT_LIMIT)] * len(small) != []
    assert ComparisonExtent((MIDDLE,), ("unified",), (1.0,)).tight


def test_a_rig_without_bounds_is_only_lost_where_a_run_fails() -> None:
    assert not lost(made(rig="wrong", tracking_error_peak_m=5e-3))
    assert lost(made(rig="wrong", completed=False))


def test_the_tables_hold_the_worst_and_each_run() -> None:
    fast = made(
        duration=0.5,
        margin_nm=7.5,
        margin_share=0.75,
        torque_peak_nm=2.5,
        torque_requested_peak_nm=12.0,
        torque_saturated_samples=4,
        tracking_error_peak_m=1e-3,
        **REFUSED,
    )
    failed = made("ctc", completed=False, why_not="tracking_lost: <far> away")
    results = [fast, made(), failed]
    overview = overview_table(results)
    unified, ctc = (dict(zip(overview.columns, row, strict=True)) for row in overview.rows)
    assert (unified["succeeded"].text, ctc["succeeded"].text) == ("2 of 2", "0 of 1")
    assert (unified["succeeded"].good, ctc["succeeded"].good) == (True, False)
    assert (unified["error"].text, unified["applied"].value, unified["margin"].value) == ("1.00 mm", 2.5, 7.5)
    assert (unified["saturated"].value, unified["refused by the screen"].text) == (4, "1 of 2")
    (runs,) = run_tables(results)
    assert [row[0].value for row in runs.rows] == ["unified", "unified", "ctc"]
    assert [row[1].text for row in runs.rows] == ["0.5 s", "1 s", "1 s"]
    assert "7.50 Nm (75%)" in [cell.text for cell in runs.rows[0]]
    assert "stopped: tracking_lost: &lt;far&gt; away" in html_page([], [], [runs], "", "")
    # a run that made its motion, but beyond the tolerance, has not succeeded
    beyond = overview_table([made(outcome=RunOutcome.OFF_REFERENCE), made()])
    assert dict(zip(beyond.columns, beyond.rows[0], strict=True))["succeeded"].text == "1 of 2"
    quickest = made(duration=None, segments_s="1.02 1.25")
    assert tight_table([quickest]).rows[0][3].text == "quickest: 1.02–1.25 s"


def test_a_verdict_that_is_missed_is_called_so() -> None:
    page = html_page(
        findings([made(torque_peak_nm=1.2), made(rig="realistic")], []), [], [], "<setting>", "fivebar compare"
    )
    verdicts = page.partition("<h2>")[0]
    order = [verdicts.index(word) for word in ("<strong>Not met</strong>", "<strong>Met</strong>", "<strong>Not known")]
    assert order == sorted(order)
    assert "1.20 Nm" in verdicts
    assert "<setting>" not in page


@pytest.mark.extra
def test_a_comparison_leaves_page_json_and_csv(tmp_path: Path) -> None:
    given = {"scenarios": ("middle",), "controllers": ("ctc", "unified"), "durations": (0.5,), "rigs": ("ideal",)}
    seen: list[tuple[int, int]] = []
    compared = run_study(COMPARISON, given, tmp_path / "out", progress=lambda done, total: seen.append((done, total)))
    assert seen == [(done, 6) for done in range(7)]
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        "compare.html",
        "compare.json",
        "compare.csv",
        "compare.parquet",
        "compare.schema.json",
        "figures",
    }
    content = json.loads((tmp_path / "out" / "compare.json").read_text(encoding="utf-8"))
    assert content == compared.content
    with (tmp_path / "out" / "compare.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["motion"] for row in rows] == ["middle"] * 6
    by_run = {(run["controller"], run["torque_limit_nm"], run["segment_duration_s"]): run for run in content["runs"]}
    ctc, unified = by_run["ctc", 10.0, 0.5], by_run["unified", 10.0, 0.5]
    assert unified["completed"] and unified["tracking_error_peak_m"] < 0.4e-3 and unified["torque_peak_nm"] < 1.0
    # alone on the locus, computed torque control asks for what no drive has
    assert ctc["torque_requested_peak_nm"] > 100.0 > 10.0 >= ctc["torque_peak_nm"]
    assert ctc["torque_saturated_samples"] > 0 < ctc["samples_at_limit"]
    # the box alone saves nothing, and the screen says so beforehand
    tight = by_run["unified", TIGHT_LIMIT, 0.5]
    assert tight["refused_by_screen"] and "reference torque" in tight["screen_says"]
    assert not tight["completed"] or tight["tracking_error_peak_m"] > 0.4e-3
    # it asks for no more than there is, but gets all of it; the slowed motion leaves a margin
    assert tight["torque_requested_peak_nm"] == pytest.approx(TIGHT_LIMIT) and tight["samples_at_limit"] > 10
    slowed = by_run["unified", TIGHT_LIMIT, None]
    assert slowed["samples_at_limit"] == 0
    assert slowed["completed"] and not slowed["refused_by_screen"] and slowed["tracking_error_peak_m"] < 0.4e-3
    assert [finding.met for finding in compared.shown[0]] == [True, None, True]
    page = compared.page.read_text(encoding="utf-8")
    assert page.count("data:image/png;base64,") == 1
    assert "http://" not in page and "https://" not in page


@pytest.mark.parametrize(
    ("arguments", "complaint"),
    [
        (["--controllers", "unified,pid"], "--controllers: 'pid': expected one of ctc, multi_joint"),
        (["--controllers", ""], "--controllers: '': expected one of ctc"),
        (["--rig", "ideal,worn"], "--rig: 'worn': expected one of calibrated, encoders, good, ideal"),
        (["--rig", ""], "--rig: '': expected one of calibrated"),
        (["--durations", "1,fast"], "--durations: 'fast': expected seconds above 0"),
        (["--durations", "0"], "--durations: '0': expected seconds above 0"),
        (["--durations", "nan"], "--durations: 'nan': expected seconds above 0"),
        (["--durations", "61"], "--durations: '61': expected seconds above 0 and up to 60"),
        (["nowhere"], "scenario 'nowhere': expected one of "),
        (["middle", "middle"], "scenario 'middle': is given more than once"),
        (["--robot", "nobody"], "robot 'nobody': expected "),
        (["multiple", "--robot", "motkin"], "robot 'motkin': 0.889 times as large as dextar: "),
        (["--out", "full"], "full: is not empty"),
    ],
)
def test_bad_input_is_one_line(
    arguments: list[str], complaint: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    result = CliRunner().invoke(app, ["compare", *arguments])
    assert result.exit_code == 2
    assert result.stderr.startswith(f"fivebar: {complaint}")
    assert result.stderr.count("\n") == 1
    assert sorted(path.name for path in tmp_path.iterdir()) == ["full"]


@pytest.mark.extra
def test_the_command_prints_the_json_that_it_writes(tmp_path: Path) -> None:
    options = ["--quick", "--controllers", "unified", "--rig", "ideal", "--durations", "0.3", "--jobs", "1"]
    result = CliRunner().invoke(app, ["compare", *options, "--out", str(tmp_path / "out"), "--json"])
    assert result.exit_code == 0, result.stderr
    content = json.loads(result.stdout)
    assert content == json.loads((tmp_path / "out" / "compare.json").read_text(encoding="utf-8"))
    assert content["command"].startswith("fivebar compare middle --controllers unified --durations 0.3 --rig ideal")


def test_bounds_go_with_the_size_and_the_torque_of_the_robot() -> None:
    motkin = load_scenario("motkin_middle")
    case = ComparisonCase(motkin, "unified", 1.0, "ideal")
    assert (case.size, case.torque) == (pytest.approx(0.08 / 0.09), pytest.approx(0.035 / 0.55))
    within = made(tracking_error_peak_m=0.35e-3, torque_peak_nm=0.06)._replace(case=case)
    for change, met in (({}, True), ({"tracking_error_peak_m": 0.36e-3}, False), ({"torque_peak_nm": 0.065}, False)):
        (finding, *_) = findings([within._replace(row=within.row._replace(**change))], [])  # type: ignore[arg-type]
        assert finding.met is met and "in proportion" in finding.expected


def test_another_robot_makes_the_motion_in_proportion_and_is_judged_by_its_own_limits() -> None:
    belt = str(Path(__file__).parents[3] / "data" / "belt.yaml")
    given, size, torque = scenario_on("middle", belt), 0.16375 / 0.09, 0.5 * 8.0 / 0.55
    assert given.waypoints == tuple((pytest.approx(size * x), pytest.approx(size * y)) for x, y in MIDDLE.waypoints)
    assert (motor_torque_limit(given), given.error_tolerance) == (8.0, pytest.approx(size * MIDDLE.error_tolerance))
    assert default_rigs(given)[: len(COMPARED_RIGS) + 1] == (*COMPARED_RIGS, f"robot:{belt}")
    on_encoders = ComparisonCase(given, "unified", 1.0, "encoders").scenario()
    assert on_encoders.plant.torque_quantum == pytest.approx(torque * 0.002)
    declared = ComparisonCase(given, "unified", 1.0, f"robot:{belt}").scenario()
    assert (declared.plant.transmission.frequency, declared.unified.kp) == (60.0, pytest.approx(37.7**2))
    # what DexTAR's drives could not, and its bound would not, let pass
    case = ComparisonCase(given, "unified", 1.0, "ideal")
    runs = [made(tracking_error_peak_m=0.7e-3, torque_peak_nm=torque)._replace(case=case) for torque in (7.2, 7.3)]
    judged = [findings([run], [])[0].met for run in runs]
    assert judged == [True, False]
    tight = [
        made(completed=False)._replace(case=ComparisonCase(given, "unified", duration, "ideal", torque * TIGHT_LIMIT))
        for duration in (1.0, None)
    ]
    assert findings([], tight)[-1].title == "unified with 4.36 Nm per motor"
    assert tight_table(tight).title == "With 4.36 Nm per motor"
    assert command_of(ComparisonSettings(scenarios=("middle",), robot=belt)).endswith(f"--robot {belt}")


@pytest.mark.extra
def test_a_law_from_elsewhere_is_compared() -> None:
    settings = ComparisonSettings(
        scenarios=("middle",), controllers=("toy_law:LAW",), durations=(1.0,), rigs=("ideal",)
    )
    assert len(cases_of(settings).asked) == 1
    (row,) = COMPARISON.run(settings, 0)
    assert (row.controller, row.completed, row.samples) == ("toy_law:LAW", True, 1001)


@pytest.mark.parametrize(
    "figures",
    [
        {"tracking_error_peak_m": None},
        {"tracking_error_peak_m": None, "torque_requested_peak_nm": None},
        {"tracking_error_peak_m": 1.0, "torque_requested_peak_nm": 100.0},
    ],
)
def test_the_figures_are_drawn_without_a_warning_whatever_is_known(
    crossing: ComparedRun, figures: dict[str, object], recwarn: pytest.WarningsRecorder
) -> None:
    (picture,) = compare_figures([crossing._replace(row=crossing.row._replace(**figures))])  # type: ignore[arg-type]
    assert picture.name.startswith("middle") and not [str(one.message) for one in recwarn]
