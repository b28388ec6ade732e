# SPDX-License-Identifier: Apache-2.0
"""The page of results is what its data make of it, and what other pages say of the numbers is in these."""

from __future__ import annotations

import multiprocessing
import re
import shutil
import subprocess
import sys
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any, NamedTuple

import pytest
from toy_study import TOY

from fivebar_description.modules import load_part
from fivebar_description.rounding import in_millimetres
from fivebar_description.strict_yaml import InputError
from fivebar_studies.engine.executor import LocalProcesses
from fivebar_studies.engine.running import FinishedStudy, silent
from fivebar_studies.engine.table import RowTable
from fivebar_studies.reproduce.verdicts import Verdict
from fivebar_studies.sweep.drawing import draw
from fivebar_studies.sweep.rows import FEASIBLE, SCREENED_OUT, SUCCESS_PROBABILITY, SweepRow
from result_pages import comparison, crossing, faults, laws, odds, rigs
from result_pages.catalogue import PAGES, RUNS, whole_sample
from result_pages.crossing_gain import MODE, PAIR, ROBOT
from result_pages.making import ResultFiles, checked_cases, make_results
from result_pages.page import MadeRun, ResultPage, StudyRun, TextTable

HOME = Path(__file__).parents[3]
RESULTS = HOME / "docs" / "results"


@pytest.fixture(scope="module")
def kept() -> ResultFiles:
    return ResultFiles(RESULTS, PAGES, whole_sample)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_section_has_its_data_and_its_figure(page: ResultPage[Any], kept: ResultFiles) -> None:
    assert kept.rows[page.name], "expected data: python docs/studies/make_result_pages.py --out docs/results"
    assert (RESULTS / f"{page.name}.svg").is_file()
    assert {row[0] for row in kept.rows[page.name]} <= set(kept.made)


def test_the_page_says_what_its_data_say(kept: ResultFiles) -> None:
    again = "expected what `python docs/studies/make_result_pages.py --draw --out docs/results` writes"
    assert (RESULTS / "index.md").read_text(encoding="utf-8") == kept.whole(with_tables=False), again
    assert kept.whole().count("\n| --- |") > len(PAGES)


def test_all_rows_are_made_by_the_command(kept: ResultFiles) -> None:
    assert not [run for run, one in kept.made.items() if not (one.version and one.program)]


def test_a_section_says_by_how_much_its_samples_are_smaller_than_the_whole_ones(kept: ResultFiles) -> None:
    made, rows = kept.made["middling"], [row for row in kept.rows["odds"] if row.run == "middling"]
    page = odds.ODDS.markdown(rows, [made._replace(sample=30)], {"middling": 1000})
    assert "\n**Smaller samples than the whole ones:** `middling` 30 of 1000. " in page
    assert "Smaller samples" not in odds.ODDS.markdown(rows, [made._replace(sample=1000)], {"middling": 1000})


def test_every_run_is_one_of_its_study_and_for_a_page() -> None:
    for run in RUNS.values():
        study = load_part(run.study)
        whole, quick = (study.settings_with(run.given(quick)) for quick in (False, True))
        assert study.needed(quick) < study.needed(whole), run.name
        program = "(fivebar|python docs/studies/make_result_pages.py --only)"
        assert re.match(rf"{program} {study.name}\b", study.command(whole))
    assert {run for page in PAGES for run in page.runs} == set(RUNS)


def test_pages_state_the_numbers_of_the_data(kept: ResultFiles) -> None:
    of = {row.rig: row for row in kept.rows["rigs"]}
    calibrated, middling = of["calibrated"], of["middling"]
    within = {rig: f"{row.within_2_mm} of {row.accepted}" for rig, row in of.items()}
    lost = "none lost silently" if calibrated.silent == middling.silent == 0 else "lost silently"
    score = {(row.rig, row.controller): row for row in kept.rows["laws"]}
    small = [score[rig, law] for rig in ("calibrated", "good") for law in ("unified", "mpc")]
    shares = sorted(100 * row.successes / row.crossings for row in small)
    claims = kept.rows["thesis"]
    missed = [row for row in claims if row.verdict == Verdict.NOT_REPRODUCED]
    reproduced = [row for row in claims if row.verdict in (Verdict.AGREED, Verdict.BETTER)]
    stated = {
        "docs/index.md": (
            f"{len(reproduced)} of {len(claims)} of its figures and claims",
            *(row.place for row in missed),
        ),
        "README.md": (f"{within['calibrated']} on a calibrated robot, {within['middling']} on a middling one, {lost}",),
        "paper/paper.md": (
            f"| {calibrated.accepted} | {calibrated.within_2_mm} |",
            f"| {middling.accepted} | {middling.within_2_mm} |",
            f"reproduces {len(reproduced)} of its {len(claims)} figures and claims",
        ),
        "docs/faq.md": (
            f"within {in_millimetres(calibrated.error_95)} of its reference in 95 %",
            f"within {in_millimetres(middling.error_95)}",
        ),
        "docs/estimation.md": (f"{within['printed']} random crossings within 2 mm",),
        "docs/laws.md": (f"`unified` and `mpc` make {shares[0]:.0f} to {shares[-1]:.0f} %",),
    }
    texts = {name: " ".join((HOME / name).read_text(encoding="utf-8").split()) for name in stated}
    assert not [(name, words) for name, said in stated.items() for words in said if words not in texts[name]]


def swept(number: int, status: str, **others: Any) -> SweepRow:
    case = draw(1, number, "middling")
    given = {"success": True, "crossings": 1, "mode_changes": 1, "error_peak": 1e-3, "estimate_error": 1e-4}
    row = SweepRow(number, "unified", status, "", True, "", *case[1:])
    return row._replace(**{**given, "drawn_robots": 24, "likely_robots": 24, **others})


SWEPT = [
    swept(0, FEASIBLE),
    swept(1, FEASIBLE, error_peak=3e-3, success=False),
    swept(2, FEASIBLE, error_peak=9e-3, success=False, left_time=0.2, fault="tracking_lost", fault_time=0.21),
    swept(3, FEASIBLE, mode_changes=0, success=False),
    swept(4, SCREENED_OUT, reason="torque of the reference is 3, expected at most 2"),
    swept(5, SCREENED_OUT, reason=f"{SUCCESS_PROBABILITY} is 0.5, expected at least 0.9", likely_robots=12),
    swept(6, SCREENED_OUT, reason=f"{SUCCESS_PROBABILITY} is 0.5", likely_robots=12, success=False),
]


def finished(rows: Sequence[Any]) -> FinishedStudy:
    return FinishedStudy(Path("page"), rows, {}, None)


def test_a_sweep_is_counted() -> None:
    (row,) = rigs.rig_rows("middling", finished(SWEPT))
    assert (row.drawn, row.accepted, row.successes, row.within_2_mm, row.within_5_mm) == (7, 4, 1, 1, 2)
    assert (row.stopped, row.faults, row.silent) == (1, "tracking_lost 1", 1)
    assert (row.refused, row.refused_successes, row.unlikely, row.unlikely_successes) == (1, 1, 2, 1)
    assert row.error_50 == pytest.approx(2e-3)
    table = {line[0]: line[1] for line in rigs.rigs_table([row]).rows}
    assert table["success, if these count as failures"].startswith("1, 16.66 %")


def test_odds_are_counted_without_what_else_is_refused() -> None:
    rows = odds.odds_rows("middling", finished(SWEPT))
    counted = [(row.likely_robots, row.accepted, row.crossings, row.successes) for row in rows]
    assert counted == [(12, False, 2, 1), (24, True, 4, 1)]
    table = odds.odds_table(rows)
    assert table.columns == ("accepted from", "middling")
    accepted = {line[0]: line[1] for line in table.rows}
    assert accepted["0.9, the default"] == "4 of 6: 25.00 %; 16.66 %"


def test_odds_are_compared_in_ten_intervals_for_each_rig_that_there_is() -> None:
    def of(rig: str, likely: int, crossings: int, successes: int) -> odds.OddsRow:
        return odds.OddsRow(rig, rig, 20, likely, likely > 10, crossings, successes)

    rows = [of("good", 20, 100, 100), of("middling", 18, 10, 9), of("middling", 19, 10, 8), of("middling", 6, 10, 4)]
    normal = of("middling:normal", 17, 4, 4)
    # 6 of 20 begin an interval, 20 of 20 belong to the last one
    assert odds.binned(rows[1:]) == [(0.3, 4, 10), (pytest.approx(0.925), 17, 20)]
    assert odds.binned(rows[:1]) == [(1.0, 100, 100)]
    lines = {line[0]: line[1:] for line in odds.bias_table([*rows, normal]).rows}
    assert [*lines] == ["good", "middling", "middling, normally distributed"]
    # the ten that are refused do not count
    assert lines["middling"][:2] == ("20", "92.50 %")
    # of 17 of 20 the exact interval is 62.1 to 96.8 %
    assert lines["middling"][-1] == "+7.5 (-4.3 to +30.4)"
    assert len(odds.odds_table(rows).columns) == 3
    page = odds.ODDS.markdown(rows, [])
    assert "crossings is between 0.0 points on `good` and +7.5 points on `middling`." in page
    assert "`middling:normal`" not in page
    for some in (rows, [*rows, normal]):
        labels = odds.ODDS.figure(some).axes[0].get_legend_handles_labels()[1]
        assert labels == [line[0] for line in odds.bias_table(some).rows]


def test_laws_whose_intervals_meet_that_of_the_best_are_named_together() -> None:
    def of(controller: str, successes: int) -> laws.LawRow:
        return laws.LawRow("benchmark_good", "good", controller, 1000, successes, 1e-3, None, None, None)

    rows = [of("unified", 937), of("mpc", 933), of("lqr", 842)]
    assert laws.LAWS.answer(rows).endswith("`unified`, `mpc` on `good`.")
    assert laws.laws_table(rows).rows[2][1] == "842 of 1000, 1.00 mm"


def test_a_comparison_says_which_motions_it_has_made() -> None:
    first = comparison.MotionRow("compare", "middle", "ideal", "unified", 2.0, False, "succeeded", 1e-4, 1.0, 1.0, 1.0)
    rows = [first, first._replace(segment_duration=0.5, outcome="tracking_lost"), first._replace(tight=True)]
    assert comparison.COMPARISON.answer(rows) == (
        "On `middle`, with segments of 0.5, 2 s, runs succeed: 1 of 2 with `unified`."
    )


def test_the_first_failure_of_an_effect_is_shown(kept: ResultFiles) -> None:
    rows = [row for row in kept.rows["faults"] if (row.effect, row.equipment) == ("lengths", "unified, gyro")]
    failing = [row._replace(failed=int(row.size > 0.1)) for row in rows]
    (line,) = faults.faults_table(failing).rows
    first = next(row.size for row in rows if row.size > 0.1)
    assert line[1:] == ["0.02 mm", "0.2 mm", f"{first:.3g} mm"]
    (none,) = faults.faults_table([row._replace(failed=0) for row in rows]).rows
    assert none[-1] == f"– ({rows[-1].size:.3g} mm)"


def test_what_crossing_buys_is_counted() -> None:
    def pair(without: float | None, across: float | None) -> crossing.CrossingRow:
        times = without, across, without, across
        return crossing.CrossingRow("crossing_gain", "dextar", PAIR, "", None, None, None, None, *times)

    nothing = None, None, None, None
    mode = crossing.CrossingRow("crossing_gain", "dextar", MODE, "(+1, +1)", 500.0, 250.0, 0.5, 1.0, *nothing)
    whole = crossing.CrossingRow("crossing_gain", "dextar", ROBOT, "", None, None, 0.8, 1.0, *nothing)
    rows = [mode, whole, pair(1.0, 1.0), pair(1.0, 0.5), pair(None, 2.0), pair(None, None)]
    assert "crossing adds 100 to 100 %" in crossing.CROSSING.answer(rows)
    assert "1 of 4 random pairs" in crossing.CROSSING.answer(rows)
    table = [line[1] for line in crossing.crossing_table(rows).rows]
    assert table[:4] == ["500, 250 cm², 50.0 %", "80.0 %", "4, 1", "1"]
    assert table[4:7] == ["2, 1", "0.50, 0.50", "1, 0.75 s"]


class ToyRow(NamedTuple):
    """A row of the toy study, and of its page."""

    run: str
    value: float


def toy_page() -> ResultPage[ToyRow]:
    # here, because figures take a second to load
    from matplotlib.figure import Figure

    return ResultPage(
        name="toy",
        title="Toy",
        question="what?",
        runs=("one", "two"),
        table=RowTable(ToyRow),
        rows=lambda run, done: [ToyRow(run, row.value) for row in done.rows],
        answer=lambda rows: f"{len(rows)} rows.",
        shown=lambda rows: TextTable(("run|s", "value"), [(row.run, f"{row.value:g}") for row in rows]),
        figure=lambda rows: Figure(figsize=(1, 1)),
        caption="A figure",
        words="Words.",
        limits=("All.",),
    )


def made(
    folder: Path,
    value: float,
    quick: bool = False,
    runs: Sequence[str] = ("one", "two"),
    processes: LocalProcesses | None = None,
) -> list[str]:
    """Make the toy page, and return what is told."""
    told: list[str] = []
    files = ResultFiles(folder / "pages", (toy_page(),))
    chosen = [StudyRun(run, TOY.place, {"cases": 3, "value": value}, {"cases": 2}) for run in runs]
    make_results(
        files,
        chosen,
        folder / f"studies-{value}",
        quick,
        processes or LocalProcesses(1),
        lambda name: nullcontext(silent),
        told.append,
    )
    return told


def test_a_run_replaces_its_rows_and_no_others(tmp_path: Path) -> None:
    assert made(tmp_path, 1.0, quick=True) == []
    made(tmp_path, 2.0, runs=("one",))
    csv = (tmp_path / "pages/toy.csv").read_text(encoding="utf-8")
    assert csv == "run,value\n" + 3 * "one,2.0\n" + 2 * "two,1.0\n"
    page = (tmp_path / "pages/index.md").read_text(encoding="utf-8")
    assert "5 rows.\n" in page
    assert "| value |" not in page
    assert "| run\\|s | value |" in ResultFiles(tmp_path / "pages", (toy_page(),)).whole()
    listed = (tmp_path / "pages/made.csv").read_text(encoding="utf-8")
    assert re.search(r"^one,3,\d{4}-\d\d-\d\d,\d.*,toy --cases 3 --value 2,3,[0-9a-f]{16}$", listed, re.MULTILINE)


def test_processes_go_from_one_study_to_the_next(tmp_path: Path) -> None:
    before = set(multiprocessing.active_children())
    with LocalProcesses(2) as processes:
        made(tmp_path, 1.0, processes=processes)
        kept = set(multiprocessing.active_children()) - before
        made(tmp_path, 2.0, processes=processes)
        assert len(kept) == 2
        assert set(multiprocessing.active_children()) - before == kept


def test_a_quick_run_leaves_larger_samples_as_they_are(tmp_path: Path) -> None:
    made(tmp_path, 1.0)
    before = (tmp_path / "pages/toy.csv").read_text(encoding="utf-8")
    told = made(tmp_path, 2.0, quick=True)
    assert [words.partition(":")[0] for words in told] == ["one", "two"]
    assert "3 of " in told[0]
    assert (tmp_path / "pages/toy.csv").read_text(encoding="utf-8") == before


def test_two_commands_write_the_same_pages(tmp_path: Path) -> None:
    """The one that ends last has read what the other has left meanwhile."""
    made(tmp_path, 1.0, runs=("one",))
    files = ResultFiles(tmp_path / "pages", (toy_page(),))
    made(tmp_path, 2.0, runs=("two",))
    files.replace(files.made["one"]._replace(sample=7), {"toy": [ToyRow("one", 3.0)]})
    again = ResultFiles(tmp_path / "pages", (toy_page(),))
    assert again.rows["toy"] == [ToyRow("one", 3.0), *[ToyRow("two", 2.0)] * 3]
    assert (again.made["one"].sample, again.made["two"].sample) == (7, 3)


def test_the_same_run_again_keeps_its_date(tmp_path: Path) -> None:
    made(tmp_path, 1.0)
    files = ResultFiles(tmp_path / "pages", (toy_page(),))
    old = files.made["one"]._replace(made="2001-02-03")
    files.replace(old, {"toy": [ToyRow("one", 1.0)]})
    made(tmp_path, 1.0)
    again = ResultFiles(tmp_path / "pages", (toy_page(),)).made
    assert again["one"] == old
    assert again["two"].made > "2001-02-03"


def test_a_run_is_outdated_where_its_rows_would_be_others(tmp_path: Path) -> None:
    made(tmp_path, 1.0, runs=("one",))
    files = ResultFiles(tmp_path / "pages", (toy_page(),))
    same, other, never = (
        StudyRun(run, TOY.place, {"cases": 3, "value": value}, {"cases": 2})
        for run, value in (("one", 1.0), ("one", 2.0), ("two", 1.0))
    )

    def outdated(run: StudyRun) -> str:
        return files.outdated(run, LocalProcesses(1), silent)

    assert outdated(same) == ""
    assert outdated(other) == "made by toy --cases 3 --value 1, expected toy --cases 3 --value 2"
    assert outdated(never) == "has not been made"
    # other code that makes the same rows, and code that makes others
    files.made["one"] = files.made["one"]._replace(program="0123456789abcdef")
    assert outdated(same) == ""
    files.made["one"] = files.made["one"]._replace(spot_check="0123456789abcdef")
    assert outdated(same) == "other code made it, and of 3 of its cases some come out otherwise now"


def test_cases_all_over_a_run_are_checked() -> None:
    assert checked_cases(1, 3) == [0, 1, 2]
    assert checked_cases(2, 379) == [0, 47, 94, 142, 189, 236, 284, 331]


def test_the_script_names_the_runs_that_would_come_out_otherwise(tmp_path: Path) -> None:
    called = script("--check", "--only", "exact,compare", "--out", str(tmp_path / "pages"))
    assert called.returncode == 1, called.stderr
    assert called.stdout.splitlines() == [f"{name}: has not been made" for name in ("exact", "compare")]


def test_data_that_are_none_are_refused_in_one_line(tmp_path: Path) -> None:
    made(tmp_path, 1.0)
    for name, content, said in (
        ("toy.csv", "run,size\n", "toy.csv: line 1: expected run,value"),
        ("toy.csv", "run,value\none,x\n", "toy.csv: line 2: "),
        ("made.csv", "run\n", "made.csv: line 1: expected run,sample,made,version,program,command,cases,spot_check"),
    ):
        whole = (tmp_path / "pages" / name).read_bytes()
        (tmp_path / "pages" / name).write_text(content, encoding="utf-8")
        with pytest.raises(InputError, match=said):
            ResultFiles(tmp_path / "pages", (toy_page(),))
        (tmp_path / "pages" / name).write_bytes(whole)
    assert MadeRun._fields[0] == "run"


def script(*options: str) -> subprocess.CompletedProcess[str]:
    command = [sys.executable, str(HOME / "docs" / "studies" / "make_result_pages.py"), *options]
    return subprocess.run(command, capture_output=True, text=True, timeout=300, check=False)


@pytest.mark.extra
def test_the_script_draws_the_page_again_from_their_data(tmp_path: Path) -> None:
    shutil.copytree(RESULTS, tmp_path / "pages")
    (tmp_path / "pages/index.md").unlink()
    called = script("--draw", "--out", str(tmp_path / "pages"))
    assert called.returncode == 0, called.stderr
    for path in RESULTS.glob("*.[cm]*"):
        assert (tmp_path / "pages" / path.name).read_bytes() == path.read_bytes(), path.name


def test_an_unknown_run_is_refused_and_leaves_no_folder(tmp_path: Path) -> None:
    called = script("--only", "calibratd", "--out", str(tmp_path / "pages"))
    assert called.returncode == 2
    assert not (tmp_path / "pages").exists()
    assert "--only: 'calibratd'" in called.stderr
    assert "calibrated" in called.stderr
