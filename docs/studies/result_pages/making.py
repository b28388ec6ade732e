# SPDX-License-Identifier: Apache-2.0
"""Runs the studies of the page of results, one after the other, and writes page and data as they come."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from datetime import date
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fivebar_bringup.pages.style import house_style, svg
from fivebar_bringup.recorded.results import json_text, write_errors, write_results
from fivebar_description.errors import InputError
from fivebar_description.files import LARGEST_TABLE, read_text
from fivebar_description.modules import load_part
from fivebar_studies.engine.executor import Executor
from fivebar_studies.engine.running import Progress, run_study
from fivebar_studies.engine.table import RowTable
from result_pages.page import MADE, MadeRun, ResultPage, StudyRun

MADE_FILE = "made.csv"
PAGE_FILE = "index.md"

INTRODUCTION = """\
# Results

Everything here is **simulated**: nothing was measured on a robot. No section has robots that are worse than their file
says. The documentation site (`make docs`) shows the rows as tables. [made.csv](made.csv) has sample, date, version and
command of every run; `make results` repeats them all.
"""


class ResultFiles:
    """The folder of the pages and their data."""

    def __init__(
        self, folder: Path, pages: Sequence[ResultPage[Any]], whole_sample: Callable[[str], int] = lambda run: 0
    ) -> None:
        """Read what is there; `whole_sample` returns how large the whole sample of a run is.

        Raises:
            InputError: the folder cannot be made, or a file in it is none of the pages' data.
        """
        self.folder, self.pages, self._whole_sample = folder, pages, whole_sample
        with write_errors(folder):
            folder.mkdir(parents=True, exist_ok=True)
        self.read()

    def read(self) -> None:
        """Read what is there now.

        Raises:
            InputError: a file is none of the pages' data.
        """
        self.made = {one.run: one for one in _read(MADE, self.folder / MADE_FILE)}
        self.rows = {page.name: _read(page.table, self.folder / f"{page.name}.csv") for page in self.pages}

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Keep other commands from writing here, and read what they have left."""
        folder = os.open(self.folder, os.O_RDONLY)
        try:
            fcntl.flock(folder, fcntl.LOCK_EX)
            self.read()
            yield
        finally:
            os.close(folder)

    def replace(self, made: MadeRun, rows: Mapping[str, Sequence[Any]]) -> list[Path]:
        """Replace the rows of a run by new ones, given by the name of their page, and write these pages.

        Raises:
            InputError: the folder cannot be written to.
        """
        pages = [page for page in self.pages if page.name in rows]
        with self.alone():
            self.made[made.run] = made
            for page in pages:
                by_run = {run: [row for row in self.rows[page.name] if row[0] == run] for run in page.runs}
                by_run[made.run] = [*rows[page.name]]
                self.rows[page.name] = [row for run in page.runs for row in by_run[run]]
            return self.write(pages)

    def write(self, pages: Iterable[ResultPage[Any]]) -> list[Path]:
        """Write the page, with data, figures and schemas of some of its sections, and return what to look at.

        Raises:
            InputError: the folder cannot be written to.
        """
        write_results(self.folder, {MADE_FILE: MADE.head + MADE.lines(self.made[run] for run in sorted(self.made))})
        written = 0
        for page in pages:
            rows = self.rows[page.name]
            if not rows:
                continue
            with house_style():
                drawn = svg(page.figure(rows))
            files: dict[str, str | bytes] = {
                f"{page.name}.csv": page.table.head + page.table.lines(rows),
                f"{page.name}.schema.json": json_text(page.table.schema()),
                f"{page.name}.svg": drawn,
            }
            write_results(self.folder, files)
            written += 1
        if not written:
            return []
        write_results(self.folder, {PAGE_FILE: self.whole(with_tables=False)})
        return [self.folder / PAGE_FILE]

    def whole(self, with_tables: bool = True) -> str:
        """Return the page of all sections of which there are rows; the one beside them has no tables."""
        sections = (self.markdown(page, with_tables) for page in self.pages if self.rows[page.name])
        return "\n".join((INTRODUCTION, *sections))

    def markdown(self, page: ResultPage[Any], with_tables: bool) -> str:
        """Return the section of the rows that are there."""
        made = [self.made[run] for run in page.runs if run in self.made]
        whole = {one.run: self._whole_sample(one.run) for one in made}
        return page.markdown(self.rows[page.name], made, whole, with_tables)


def _read(table: RowTable[Any], path: Path) -> list[Any]:
    if not path.is_file():
        return []
    text = read_text(path, LARGEST_TABLE)
    if not text.startswith(table.head):
        raise InputError(f"{path}: line 1: expected {table.head.strip()}")
    try:
        return table.read(text.removeprefix(table.head))
    except ValueError as error:
        raise InputError(f"{path}: {error}") from error


def make_results(
    files: ResultFiles,
    runs: Sequence[StudyRun],
    studies: Path,
    quick: bool,
    executor: Executor,
    progress: Callable[[str], AbstractContextManager[Progress]],
    tell: Callable[[str], None],
) -> list[Path]:
    """Run studies, write the pages that they are for, and return these.

    What was interrupted resumes, as long as the code that decides the rows is the same. A quick run leaves rows of a
    larger sample as they are.

    Args:
        files: of the pages.
        runs: which.
        studies: where each run has its folder.
        quick: with the small samples.
        executor: runs the cases.
        progress: shows the progress of a run with a name.
        tell: is told what is left as it is.

    Raises:
        InputError: a folder cannot be used.
        ResumableInterrupt: it was interrupted.
    """
    written: dict[Path, None] = {}
    for run in runs:
        study, given = load_part(run.study), run.given(quick)
        settings = study.settings_with(given)
        sample, program = study.needed(settings), study.program(settings)
        there = files.made.get(run.name)
        if quick and there is not None and there.sample > sample:
            tell(f"{run.name}: left as it is: {there.sample} of {there.made} are more than {sample}")
            continue
        out = studies / f"{run.name}{'-quick' if quick else ''}-{program}"
        with progress(run.name) as told:
            finished = run_study(study, given, out, executor, told)
            made = MadeRun(
                run.name, sample, f"{date.today()}", version("fivebar_bringup"), program, study.command(settings)
            )
            if there is not None and there._replace(made=made.made, version=made.version) == made:
                made = there
            rows = {page.name: page.rows(run.name, finished) for page in files.pages if run.name in page.runs}
            written |= dict.fromkeys(files.replace(made, rows))
    return [*written]
