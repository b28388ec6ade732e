# SPDX-License-Identifier: Apache-2.0
"""Definition of the comparison, its tables, figures and page."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from functools import lru_cache

from fivebar_bringup.pages.content import Picture, Table
from fivebar_bringup.pages.rendering import render
from fivebar_control.laws.registry import timed_controllers
from fivebar_studies.compare.cases import AS_GIVEN, ComparisonExtent, scenario_on
from fivebar_studies.compare.results import ComparedRun, ComparisonRow, run_case
from fivebar_studies.compare.tables import overview_table, rigs_table, run_tables, tight_table
from fivebar_studies.compare.verdicts import Requirement, findings
from fivebar_studies.engine.program import program_digest
from fivebar_studies.engine.study import Study, StudyReport, StudySettings
from fivebar_studies.engine.table import RowTable

TITLE = "Controllers side by side"

WORDS = {True: "Met", False: "Not met", None: "Not known"}


class ComparisonSettings(StudySettings):
    """The settings that determine the rows of a comparison.

    Attributes:
        scenarios: whose motions are run, by name or path.
        controllers: that make each motion.
        durations: of every segment (s).
        rigs: by name or path; None for the default ones of each scenario.
        robot: that makes the motions in proportion to its size, by the name of its file; "" for those of the scenarios.
        changes: KEY=VALUE of further keys of the scenarios.
    """

    scenarios: tuple[str, ...] = ("middle", "multiple")
    controllers: tuple[str, ...] = timed_controllers()
    durations: tuple[float, ...] = (0.5, 1.0, 2.0, 3.0)
    rigs: tuple[str, ...] | None = None
    robot: str = ""
    changes: tuple[str, ...] = ()


@lru_cache(maxsize=4)
def cases_of(settings: ComparisonSettings) -> ComparisonExtent:
    """Return the runs of a comparison."""
    scenarios = tuple(scenario_on(name, settings.robot) for name in settings.scenarios)
    return ComparisonExtent(scenarios, settings.controllers, settings.durations, settings.rigs, settings.changes)


def run_numbered(settings: ComparisonSettings, number: int) -> list[ComparisonRow]:
    """Return the row of a run."""
    extent = cases_of(settings)
    return [run_case(number, [*extent.asked, *extent.tight][number])]


def comparison_report(settings: ComparisonSettings, rows: Sequence[ComparisonRow]) -> StudyReport:
    """Return tables, figures and page."""
    # here, because workers need no matplotlib
    from fivebar_studies.compare.figures import compare_figures

    extent = cases_of(settings)
    everything = [ComparedRun(case, row) for case, row in zip([*extent.asked, *extent.tight], rows, strict=True)]
    results, tight = everything[: len(extent.asked)], everything[len(extent.asked) :]
    verdicts, overview = findings(results, tight), overview_table(results)
    tables = [overview, tight_table(tight), rigs_table(extent), *run_tables(results)]
    command = command_of(settings)
    content = {
        "command": command,
        "verdicts": [finding._asdict() for finding in verdicts],
        "rigs": rigs_table(extent).as_json()["rows"],
        "runs": [row._asdict() for row in rows],
    }
    pictures = compare_figures(results)
    page = html_page(verdicts, pictures, tables, f"{len(rows)} runs · simulated throughout, without ROS", command)
    return StudyReport(page, content, pictures, (verdicts, overview))


def html_page(
    verdicts: Sequence[Requirement], pictures: Sequence[Picture], tables: Sequence[Table], setting: str, command: str
) -> str:
    """Return the page: verdicts, figures, tables, how to repeat the comparison."""
    return render(
        "comparison.html",
        package="fivebar_studies",
        title=TITLE,
        setting=setting,
        verdicts=verdicts,
        words=WORDS,
        pictures=pictures,
        tables=tables,
        command=command,
    )


def command_of(settings: ComparisonSettings) -> str:
    """Return the command that repeats a comparison, with all options that affect its results."""
    parts = ["fivebar", "compare", *settings.scenarios, "--controllers", ",".join(settings.controllers)]
    parts += ["--durations", ",".join(f"{duration:g}" for duration in settings.durations)]
    parts += ["--rig", ",".join(settings.rigs)] if settings.rigs is not None else []
    parts += ["--robot", settings.robot] if settings.robot else []
    parts += [word for change in settings.changes for word in ("--set", change)]
    return shlex.join(parts)


def _program(settings: ComparisonSettings) -> str:
    extent = cases_of(settings)
    rigs = {case.rig for case in extent.asked} - {AS_GIVEN}
    return program_digest(
        DECIDING, {scenario.robot for scenario in extent.scenarios}, rigs, settings.controllers, extent.scenarios
    )


DECIDING = (
    "fivebar_bringup/recorded/*.py",
    *(f"fivebar_studies/compare/{module}.py" for module in ("cases", "results", "screening")),
)
"""Files that decide the rows besides those of every study."""

COMPARISON = Study(
    name="compare",
    place=f"{__name__}:COMPARISON",
    settings=ComparisonSettings,
    table=RowTable(ComparisonRow),
    run=run_numbered,
    cases=lambda settings: len(cases_of(settings).asked) + len(cases_of(settings).tight),
    chunk=lambda settings: 1,
    report=comparison_report,
    program=_program,
    command=command_of,
)
"""The study of the same motions with every controller."""
