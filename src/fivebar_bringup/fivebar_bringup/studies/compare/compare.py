"""Runs a comparison and writes its tables, figures and page."""

from __future__ import annotations

import csv
import io
import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.pages.content import Picture, Table
from fivebar_bringup.pages.rendering import render
from fivebar_bringup.recorded.results import finite, new_directory
from fivebar_bringup.studies.common.study_directory import StudyDirectory
from fivebar_bringup.studies.compare.cases import ComparisonExtent, longest_first
from fivebar_bringup.studies.compare.figures import compare_figures
from fivebar_bringup.studies.compare.results import run_case
from fivebar_bringup.studies.compare.tables import overview_table, rigs_table, run_tables, tight_table
from fivebar_bringup.studies.compare.verdicts import Requirement, findings
from fivebar_bringup.studies.engine.local import share

TITLE = "Controllers side by side"

WORDS = {True: "Met", False: "Not met", None: "Not known"}


class Comparison(NamedTuple):
    """Results of a comparison, and the page."""

    page: Path
    verdicts: Sequence[Requirement]
    overview: Table
    content: Mapping[str, Any]


def compare(
    extent: ComparisonExtent,
    out: Path | None,
    workers: int,
    command: str = "fivebar compare",
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Comparison:
    """Run all cases, and write compare.html, compare.json, compare.csv and the figures.

    Args:
        extent: what is compared.
        out: new or empty directory, by default runs/compare-<date>-<time>.
        workers: processes to use; fewer than two run everything in this one.
        command: that repeats this comparison, for the page.
        progress: called with the number of finished runs and of all.

    Raises:
        InputError: the directory cannot be used.
    """
    directory = StudyDirectory(new_directory(out, "compare"), "compare")
    began = time.monotonic()
    cases, tight_cases = extent.cases(), extent.tight_cases()
    everything = [*cases, *tight_cases]
    order = longest_first(everything)
    found = dict(zip(order, share(run_case, [everything[index] for index in order], workers, progress), strict=True))
    all_results = [found[index] for index in range(len(everything))]
    results, tight = all_results[: len(cases)], all_results[len(cases) :]
    verdicts, overview = findings(results, tight), overview_table(results)
    tables = [overview, tight_table(tight), rigs_table(extent), *run_tables(results)]
    wall_s = time.monotonic() - began
    rows = [result.as_row() for result in (*results, *tight)]
    content = finite(
        {
            "command": command,
            "wall_s": wall_s,
            "verdicts": [finding.as_json() for finding in verdicts],
            "rigs": rigs_table(extent).as_json()["rows"],
            "runs": rows,
        }
    )
    pictures = compare_figures(results)
    setting = f"{len(rows)} runs in {wall_s:.0f} s · simulated throughout, without ROS"
    page = html_page(verdicts, pictures, tables, setting, command)
    directory.write(page, content, pictures, {"compare.csv": _csv(content["runs"])})
    return Comparison(directory.page, verdicts, overview, content)


def html_page(
    verdicts: Sequence[Requirement], pictures: Sequence[Picture], tables: Sequence[Table], setting: str, command: str
) -> str:
    """Return the page: verdicts, figures, tables, how to repeat the comparison."""
    return render(
        "comparison.html",
        title=TITLE,
        setting=setting,
        verdicts=verdicts,
        words=WORDS,
        pictures=pictures,
        tables=tables,
        command=command,
    )


def _csv(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return rows with the same keys as comma-separated values; unknown values are left empty."""
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
