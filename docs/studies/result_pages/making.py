# SPDX-License-Identifier: Apache-2.0
"""Runs the studies of the page of results, one after the other, and writes page and data as they come."""

from __future__ import annotations

import fcntl
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, closing, contextmanager
from datetime import date
from hashlib import sha256
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fivebar_bringup.pages.style import house_style, svg
from fivebar_bringup.recorded.results import json_text, write_errors, write_results
from fivebar_description.errors import InputError
from fivebar_description.files import LARGEST_TABLE, read_text
from fivebar_description.modules import load_part
from fivebar_studies.engine.chunks import Chunk
from fivebar_studies.engine.executor import Executor
from fivebar_studies.engine.running import Progress, run_study
from fivebar_studies.engine.study import case_numbers
from fivebar_studies.engine.table import RowTable
from result_pages.page import MADE, MadeRun, ResultPage, StudyRun

MADE_FILE = "made.csv"
PAGE_FILE = "index.md"

INTRODUCTION = """\
# Results

Everything here is **simulated**: nothing was measured on a robot. No section has robots that are worse than their file
says. The documentation site (`make docs`) shows the rows as tables. [made.csv](made.csv) has sample, date, version and
command of every run. `make results` repeats them all. `make results OPTIONS=--check` names those that the present code
would make otherwise: of a run that other code made, some cases are run again.
"""

CHECKED_CHUNKS = 4
"""Chunks of cases of a run that a check runs again, in half a minute."""


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

    def outdated(self, run: StudyRun, executor: Executor, progress: Progress) -> str:
        """Return why the rows of a run are not those that the present code makes; empty where they are.

        Where other code made them, some of the cases are run again, and `progress` is told of these.

        Raises:
            InputError: a case cannot be run.
        """
        made, (study, settings) = self.made.get(run.name), run.loaded()
        if made is None:
            return "has not been made"
        if made.command != study.command(settings):
            return f"made by {made.command}, expected {study.command(settings)}"
        if made.program == study.program(settings):
            return ""
        if not made.spot_check:
            return "other code made it"
        cases, text = checked_cases(study.chunk(settings), made.cases), settings.model_dump_json()
        lines = ""
        with closing(executor.stream(Chunk(study.place, text, case, case + 1) for case in cases)) as coming:
            for done, rows in enumerate(coming, start=1):
                lines += rows
                progress(done, len(cases))
        same = _digest(lines) == made.spot_check
        return "" if same else f"other code made it, and of {len(cases)} of its cases some come out otherwise now"

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


def checked_cases(chunk: int, cases: int) -> list[int]:
    """Return the numbers of the cases, evenly spread over so many, by whose rows a run is checked.

    Args:
        chunk: cases that are run at one go.
        cases: of the run.
    """
    count = min(CHECKED_CHUNKS * chunk, cases)
    return [number * cases // count for number in range(count)]


def _digest(lines: str) -> str:
    return sha256(lines.encode()).hexdigest()[:16]


def _made_today(run: StudyRun, quick: bool) -> MadeRun:
    """Return the line of a run that is made today by the code that is here, before its cases have been run."""
    study, settings = run.loaded(quick)
    sample, program, command = study.needed(settings), study.program(settings), study.command(settings)
    return MadeRun(run.name, sample, f"{date.today()}", version("fivebar_bringup"), program, command, 0, "")


def _with_spot_check(made: MadeRun, run: StudyRun, quick: bool, rows: Sequence[Any]) -> MadeRun:
    """Return the line of a run with what its rows are checked by."""
    (study, settings), cases = run.loaded(quick), len(case_numbers(rows))
    checked = set(checked_cases(study.chunk(settings), cases))
    lines = study.table.lines(row for row in rows if row[0] in checked)
    return made._replace(cases=cases, spot_check=_digest(lines))


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
        made, there = _made_today(run, quick), files.made.get(run.name)
        if quick and there is not None and there.sample > made.sample:
            tell(f"{run.name}: left as it is: {there.sample} of {there.made} are more than {made.sample}")
            continue
        out = studies / f"{run.name}{'-quick' if quick else ''}-{made.program}"
        with progress(run.name) as told:
            finished = run_study(load_part(run.study), run.given(quick), out, executor, told)
            made = _with_spot_check(made, run, quick, finished.rows)
            if there is not None and there._replace(made=made.made, version=made.version) == made:
                made = there
            rows = {page.name: page.rows(run.name, finished) for page in files.pages if run.name in page.runs}
            written |= dict.fromkeys(files.replace(made, rows))
    return [*written]
