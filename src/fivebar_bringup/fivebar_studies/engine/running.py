# SPDX-License-Identifier: Apache-2.0
"""Runs the cases of a study until there are enough, in a directory that can be resumed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from shlex import quote
from typing import Any, NamedTuple

from fivebar_bringup.recorded.results import write_errors
from fivebar_description.interrupts import resumable
from fivebar_description.stages import stage
from fivebar_studies.engine.chunks import Chunk
from fivebar_studies.engine.directory import opened
from fivebar_studies.engine.executor import Executor, LocalProcesses
from fivebar_studies.engine.study import Settings, Study, case_numbers
from fivebar_studies.engine.table import Row

Progress = Callable[[int, int], None]


def silent(done: int, total: int) -> None:
    """Tell nobody of the progress."""


class FinishedStudy(NamedTuple):
    """A finished study.

    Attributes:
        page: to look at.
        rows: all of them, in order of the cases.
        content: results as plain values, as in its JSON.
        shown: what its command prints.
    """

    page: Path
    rows: Sequence[Any]
    content: Mapping[str, Any]
    shown: Any


def run_study(
    study: Study[Settings, Row],
    arguments: Mapping[str, Any],
    out: Path | None = None,
    executor: Executor | None = None,
    progress: Progress = silent,
) -> FinishedStudy:
    """Start or resume a study, and write its rows, results, figures and page.

    The rows depend on the settings only, not on the executor nor on interruptions.

    Args:
        study: which.
        arguments: settings; what is missing or None is that of the resumed study, else the default.
        out: new or empty directory, or that of a study to resume; by default runs/NAME-<date>-<time>.
        executor: runs the cases; by default this process.
        progress: called with how much there is so far of what is wanted, and with that.

    Raises:
        InputError: the directory cannot be used, or holds a study with other settings.
        ResumableInterrupt: it was interrupted; the chunks that were written are kept.
    """
    files, settings = opened(study, out, arguments)
    words = (
        f"{files.path}: interrupted: {files.rows.name} keeps the finished cases:"
        f" the same command with --out {quote(str(files.path))} resumes"
    )
    with files.alone(), write_errors(files.path), resumable(words):
        _, _, finished = files.read_settings()
        rows = files.read_rows()
        if not (finished and study.counts(settings, rows) >= study.needed(settings)):
            # the last chunk may lack rows, where process or machine have ended while it was written
            chunk = study.chunk(settings)
            rows = [row for row in rows if row[0] // chunk < rows[-1][0] // chunk]
        files.replace_rows(rows)
        for further in further_rows(study, settings, rows, executor or LocalProcesses(1), progress):
            files.append_rows(further)
            rows += further
        report = study.report(settings, rows)
        content = files.write(settings, rows, report)
        return FinishedStudy(files.directory.page, rows, content, report.shown)


def further_rows(
    study: Study[Settings, Row], settings: Settings, kept: Sequence[Row], executor: Executor, progress: Progress
) -> Iterator[list[Row]]:
    """Yield the rows of one chunk after the other, in order of the cases, until there are enough.

    Args:
        study: which.
        settings: of the study.
        kept: rows of the first cases.
        executor: runs the cases.
        progress: called with how much there is so far of what is wanted, and with that.
    """
    there, tried = study.counts(settings, kept), len(case_numbers(kept))
    wanted, cases, text = study.needed(settings), study.cases(settings), settings.model_dump_json()
    progress(min(there, wanted), wanted)
    if there >= wanted:
        return
    size = study.chunk(settings)
    firsts = range(tried, cases, size)
    chunks = (Chunk(study.place, text, first, min(first + size, cases)) for first in firsts)
    words = "starting, compiling machine code where it is new"
    with closing(executor.stream(chunks)) as coming:
        while there < wanted:
            with stage(words):
                lines = next(coming, None)
            if lines is None:
                return
            rows = study.table.read(lines)
            there += study.counts(settings, rows)
            tried += len(case_numbers(rows))
            # where not every case counts, what is tried says that it goes on
            words = "" if study.wanted is None else f"{tried} cases tried"
            yield rows
            progress(min(there, wanted), wanted)
