# SPDX-License-Identifier: Apache-2.0
"""Definition of the reproduction of the thesis as a study, with its rows, tables and page."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import Any

from fivebar_bringup.pages.content import Table
from fivebar_bringup.pages.rendering import render
from fivebar_studies.engine.program import program_digest
from fivebar_studies.engine.study import Study, StudyReport, StudySettings
from fivebar_studies.engine.table import RowTable
from fivebar_studies.reproduce import tables
from fivebar_studies.reproduce.cases import FULL, QUICK, ReproductionCase, ReproductionExtent
from fivebar_studies.reproduce.claims import CLAIMS, Claim, ClaimRow
from fivebar_studies.reproduce.runner import Drawings, ReproductionRow, Results, result_of, run_case
from fivebar_studies.reproduce.verdicts import Verdict


class ReproductionSettings(StudySettings):
    """The settings that determine the rows of a reproduction.

    Attributes:
        quick: one duration and one perturbed plant only.
        claims: names of the rows to evaluate; none for all of them, and the tables.
    """

    quick: bool = False
    claims: tuple[str, ...] = ()

    @property
    def extent(self) -> ReproductionExtent:
        """How much is run."""
        return QUICK if self.quick else FULL

    @property
    def chosen(self) -> tuple[Claim, ...]:
        """The claims that are evaluated."""
        return tuple(claim for claim in CLAIMS if not self.claims or claim.name in self.claims)


def run_numbered(settings: ReproductionSettings, number: int) -> list[ReproductionRow]:
    """Return the row of a run."""
    return [run_case(list(needs_of(settings))[number], number=number).row]


def reproduction_report(settings: ReproductionSettings, rows: Sequence[ReproductionRow]) -> StudyReport:
    """Return the claims with their verdicts, tables, figures and page."""
    needs, extent = needs_of(settings), settings.extent
    results = {case: result_of(case, row, drawn) for (case, drawn), row in zip(needs.items(), rows, strict=True)}
    claim_rows = [claim.row(extent, results) for claim in settings.chosen]
    shown = [] if settings.claims else _tables(extent, results)
    content = {
        "quick": settings.quick,
        "verdicts": {str(verdict): sum(row.judgement.verdict == verdict for row in claim_rows) for verdict in Verdict},
        "rows": [row.as_json() for row in claim_rows],
        "tables": [table.as_json() for table in shown],
        "runs": [_run(results, case) for case in sorted(results)],
    }
    page = html_page(claim_rows, shown, len(results), command_of(settings))
    return StudyReport(page, content, [picture for row in claim_rows for picture in row.pictures], claim_rows)


def command_of(settings: ReproductionSettings) -> str:
    """Return the command that repeats a reproduction."""
    return "fivebar reproduce" + (" --quick" if settings.quick else "")


def html_page(rows: Sequence[ClaimRow], tables: Sequence[Table], runs: int, command: str) -> str:
    """Return the page: an overview of the verdicts, every row with its figures, the tables."""
    counts = {verdict: sum(row.judgement.verdict == verdict for row in rows) for verdict in Verdict}
    short = ", ".join(f"{number} {verdict}" for verdict, number in counts.items())
    return render(
        "reproduction.html",
        package="fivebar_studies",
        title=f"Reproduction: {short}",
        setting=f"{short} · {runs} runs · simulated throughout",
        rows=rows,
        tables=tables,
        command=command,
    )


@lru_cache(maxsize=4)
def needs_of(settings: ReproductionSettings) -> dict[ReproductionCase, Drawings]:
    """Return all runs that rows and tables need, each once, with all figures needed of it."""
    needs: dict[ReproductionCase, Drawings] = {}
    for claim in settings.chosen:
        for case, drawings in claim.needs(settings.extent).items():
            needs[case] = tuple(dict.fromkeys((*needs.get(case, ()), *drawings)))
    if not settings.claims:
        cases = [*tables.crossing_cases(settings.extent), *tables.comparison_cases(settings.extent)]
        cases += [*tables.far_cases(), *tables.imu_cases(settings.extent)]
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


SHOWN_METRICS = (
    "crossing_residual_n",
    "acceleration_outside_zones_m_s2",
    "noise_floor_m_s2",
    "acceleration_m_s2",
    "noise_floor_whole_m_s2",
)
"""Metrics of a run besides its summary."""


def _run(results: Results, case: ReproductionCase) -> dict[str, Any]:
    result = results[case]
    return {
        "case": case._asdict(),
        "summary": None if result.summary is None else result.summary.as_dict(),
        "refused": result.row.refused or None,
        **{name: getattr(result.row, name) for name in SHOWN_METRICS},
    }


DECIDING = (
    "fivebar_bringup/recorded/*.py",
    "fivebar_bringup/report/*.py",
    *(f"fivebar_studies/reproduce/{module}.py" for module in ("cases", "runner")),
)
"""Files that decide the rows besides those of every study."""

REPRODUCTION = Study(
    name="reproduce",
    place=f"{__name__}:REPRODUCTION",
    settings=ReproductionSettings,
    table=RowTable(ReproductionRow),
    run=run_numbered,
    cases=lambda settings: len(needs_of(settings)),
    chunk=lambda settings: 1,
    report=reproduction_report,
    program=lambda settings: program_digest(DECIDING, ("dextar",)),
    command=command_of,
)
"""The study of the thesis' figures and claims."""
