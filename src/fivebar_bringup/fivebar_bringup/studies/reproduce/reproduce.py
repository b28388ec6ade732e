"""Runs the reproduction of the thesis and writes its rows, tables and page."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.pages.content import Table
from fivebar_bringup.pages.rendering import render
from fivebar_bringup.recorded.results import finite, new_directory
from fivebar_bringup.studies.common.study_directory import StudyDirectory
from fivebar_bringup.studies.reproduce import (
    claims_experiment,
    claims_methods,
    claims_model,
    claims_simulation,
    claims_vision,
    tables,
)
from fivebar_bringup.studies.reproduce.cases import FULL, QUICK, ReproductionCase, ReproductionExtent
from fivebar_bringup.studies.reproduce.rows import Claim, ClaimRow
from fivebar_bringup.studies.reproduce.runner import Drawings, Results, run_cases
from fivebar_bringup.studies.reproduce.verdicts import Verdict

WORKERS = 2
"""Number of processes for the runs."""

CLAIMS: tuple[Claim, ...] = (
    *claims_model.CLAIMS,
    *claims_simulation.CLAIMS,
    *claims_experiment.CLAIMS,
    *claims_methods.CLAIMS,
    *claims_vision.CLAIMS,
)


class Reproduction(NamedTuple):
    """Results of a reproduction, and the page."""

    page: Path
    rows: Sequence[ClaimRow]
    content: Mapping[str, Any]


def reproduce(
    out: Path | None,
    quick: bool = False,
    progress: Callable[[int, int], None] = lambda done, total: None,
    workers: int = WORKERS,
    claims: Sequence[Claim] = CLAIMS,
    with_tables: bool = True,
) -> Reproduction:
    """Run all cases, and write reproduce.html, reproduce.json and the figures.

    Args:
        out: new or empty directory, by default runs/reproduce-<date>-<time>.
        quick: one duration and one perturbed plant only.
        progress: called with the number of finished runs and of all.
        workers: processes to use; fewer than two run everything in this one.
        claims: rows to evaluate.
        with_tables: whether the tables are made.

    Raises:
        InputError: the directory cannot be used.
    """
    extent = QUICK if quick else FULL
    directory = StudyDirectory(new_directory(out, "reproduce"), "reproduce")
    began = time.monotonic()
    results = run_cases(_needs(extent, claims, with_tables), workers, progress)
    rows = [claim.make(extent, results) for claim in claims]
    made = _tables(extent, results) if with_tables else []
    wall_s = time.monotonic() - began
    content = {
        "quick": quick,
        "wall_s": wall_s,
        "verdicts": {str(verdict): sum(row.judgement.verdict == verdict for row in rows) for verdict in Verdict},
        "rows": [row.as_json() for row in rows],
        "tables": [table.as_json() for table in made],
        "runs": [_run(results, case) for case in sorted(results)],
    }
    page = html_page(rows, made, len(results), wall_s, "fivebar reproduce" + (" --quick" if quick else ""))
    directory.write(page, content, [picture for row in rows for picture in row.pictures])
    return Reproduction(directory.page, rows, finite(content))


def html_page(rows: Sequence[ClaimRow], tables: Sequence[Table], runs: int, wall_s: float, command: str) -> str:
    """Return the page: an overview of the verdicts, every row with its figures, the tables."""
    counts = {verdict: sum(row.judgement.verdict == verdict for row in rows) for verdict in Verdict}
    short = ", ".join(f"{number} {verdict}" for verdict, number in counts.items())
    return render(
        "reproduction.html",
        title=f"Reproduction: {short}",
        setting=f"{short} · {runs} runs in {wall_s:.0f} s · simulated throughout",
        rows=rows,
        tables=tables,
        command=command,
    )


def _needs(extent: ReproductionExtent, claims: Sequence[Claim], with_tables: bool) -> dict[ReproductionCase, Drawings]:
    """Return all runs that rows and tables need, each once, with all figures needed of it."""
    needs: dict[ReproductionCase, Drawings] = {}
    for claim in claims:
        for case, drawings in claim.needs(extent).items():
            needs[case] = tuple(dict.fromkeys((*needs.get(case, ()), *drawings)))
    if with_tables:
        cases = [*tables.crossing_cases(extent), *tables.comparison_cases(extent), *tables.far_cases()]
        cases += [*tables.imu_cases(extent)]
        for case in cases:
            needs.setdefault(case, ())
    return needs


def _tables(extent: ReproductionExtent, results: Results) -> list[Table]:
    return [
        tables.crossing_table(extent, results),
        tables.variants_table(extent, results),
        tables.printed_table(extent, results),
        tables.comparison_overview(extent, results),
        *tables.comparison_tables(extent, results),
        tables.far_table(results),
        tables.imu_table(extent, results),
    ]


def _run(results: Results, case: ReproductionCase) -> dict[str, Any]:
    result = results[case]
    return {
        "case": case._asdict(),
        "summary": None if result.summary is None else result.summary.as_dict(),
        "refused": result.refused,
        "crossing_residual_n": result.crossing_residual,
        "acceleration_outside_zones_m_s2": result.acceleration_outside,
        "noise_floor_m_s2": result.noise_outside,
        "acceleration_m_s2": result.acceleration_whole,
        "noise_floor_whole_m_s2": result.noise_whole,
    }
