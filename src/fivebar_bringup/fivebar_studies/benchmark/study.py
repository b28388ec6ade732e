# SPDX-License-Identifier: Apache-2.0
"""Definition of the benchmark as a study, with its table and page."""

from __future__ import annotations

from collections.abc import Sequence
from shlex import quote

from fivebar_bringup.pages.content import Cell, Line, Table, table
from fivebar_bringup.pages.rendering import study_page
from fivebar_description.rounding import in_millimetres
from fivebar_studies.benchmark.crossings import crossing_of
from fivebar_studies.benchmark.running import BenchmarkSettings, run_numbered
from fivebar_studies.benchmark.scoring import RESULTS, Result, Score, scores
from fivebar_studies.engine.program import program_digest
from fivebar_studies.engine.study import Study, StudyReport
from fivebar_studies.sweep.sweep import DECIDING


def scores_table(scored: Sequence[Score], rules: str) -> Table:
    """Return the scores by rules, those of a rig and a controller a row."""
    rows: list[Line] = []
    for score in scored:
        low, high = 100.0 * score.interval.low, 100.0 * score.interval.high
        rows.append(
            (
                score.rig,
                score.controller,
                Cell(f"{score.successes}/{score.crossings}", score.successes),
                Cell(f"{low:.1f}-{high:.1f}", [score.interval.low, score.interval.high]),
                *(
                    Cell(in_millimetres(error).removesuffix(" mm"), error)
                    for error in (score.error_median, score.error_95)
                ),
                Cell(f"{score.torque_median:.2f}", score.torque_median),
                score.stopped,
            )
        )
    columns = ("rig", "controller", "success", "95 %", "error, mm", "error of 95 %, mm", "Nm", "stopped")
    return table("scores", "Scores", rules, columns, rows)


def benchmark_report(settings: BenchmarkSettings, results: Sequence[Result]) -> StudyReport:
    """Return the scores of results, and their page."""
    crossings = [crossing_of(settings.make, number) for number in range(settings.cases)]
    limits = settings.limits
    scored = scores(results, crossings, limits)
    shown = scores_table(scored, limits.rules)
    lines = [score._asdict() | {"interval": score.interval._asdict()} for score in scored]
    page = study_page(
        title="Benchmark",
        setting=f"{settings.cases} crossings, {len(results)} runs, all simulated",
        command=command_of(settings),
        tables=[shown],
    )
    return StudyReport(page, {"rules": limits.rules, "scores": lines}, [], shown)


def command_of(settings: BenchmarkSettings) -> str:
    """Return the command that repeats a benchmark."""
    words = [f"fivebar benchmark --rig {quote(','.join(settings.rigs))}"]
    words += settings.options("controllers")
    words += [f"--robot {quote(settings.robot)}"] if settings.robot else []
    words += [f"--policy {quote(settings.policy)} --observation {settings.observation}"] if settings.policy else []
    return " ".join([*words, f"--cases {settings.cases}"])


BENCHMARK = Study(
    name="benchmark",
    place=f"{__name__}:BENCHMARK",
    settings=BenchmarkSettings,
    table=RESULTS,
    run=run_numbered,
    cases=lambda settings: settings.cases,
    chunk=lambda settings: 2,
    report=benchmark_report,
    program=lambda settings: program_digest(
        (*DECIDING, "fivebar_studies/benchmark/*.py"),
        (settings.make,),
        settings.rigs,
        settings.controllers,
        modules=[settings.policy.partition(":")[0]] if settings.policy else (),
    ),
    command=command_of,
)
"""The study of fixed crossings."""
