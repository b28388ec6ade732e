"""Runs the cases of a study until there are enough, in a directory that can be resumed."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import closing
from pathlib import Path
from shlex import quote
from tempfile import TemporaryDirectory
from typing import Any, Generic, NamedTuple

from fivebar_bringup.recorded.results import write_errors
from fivebar_bringup.studies.engine.chunks import Chunk
from fivebar_bringup.studies.engine.directory import StudyFiles, opened
from fivebar_bringup.studies.engine.executor import Executor, LocalProcesses
from fivebar_bringup.studies.engine.study import Settings, Study
from fivebar_bringup.studies.engine.table import Row
from fivebar_description.interrupts import resumable

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
    given: Mapping[str, Any],
    out: Path | None = None,
    executor: Executor | None = None,
    progress: Progress = silent,
    kept: bool = True,
) -> FinishedStudy:
    """Start or resume a study, and write its rows, results, figures and page.

    The rows depend on the settings only, not on the executor nor on interruptions.

    Args:
        study: which.
        given: settings; what is missing or None is that of the resumed study, else the default.
        out: new or empty directory, or that of a study to resume; by default runs/NAME-<date>-<time>.
        executor: runs the cases; by default this process.
        progress: called with how much there is so far of what is wanted, and with that.
        kept: whether there are files at all; else there is neither report nor directory, and `out` is None.

    Raises:
        InputError: the directory cannot be used, or holds a study with other settings.
        ResumableInterrupt: it was interrupted; the chunks that were finished are kept.
    """
    if not kept:
        with TemporaryDirectory() as folder:
            files, settings = opened(study, Path(folder), given)
            rows = _all_rows(files, settings, executor or LocalProcesses(1), progress)
            return FinishedStudy(files.page, rows, {}, None)
    files, settings = opened(study, out, given)
    words = (
        f"{files.path}: interrupted: {files.rows.name} keeps the finished cases:"
        f" the same command with --out {quote(str(files.path))} resumes"
    )
    with files.alone(), write_errors(files.path), resumable(words):
        rows = _all_rows(files, settings, executor or LocalProcesses(1), progress)
        report = study.report(settings, rows)
        content = files.write(settings, rows, report)
        return FinishedStudy(files.page, rows, content, report.shown)


class Tally(Generic[Settings, Row]):
    """The finished chunks, and how much they count for.

    Only chunks before the first missing one count, so that the order of completion does not matter.
    """

    def __init__(self, study: Study[Settings, Row], settings: Settings) -> None:
        """Start without chunks."""
        self._study, self._settings = study, settings
        self.wanted = study.needed(settings)
        self._cases = study.cases(settings)
        self._chunks: dict[int, Sequence[Row]] = {}
        self._counted = 0
        self._there = 0

    @property
    def there(self) -> int:
        """How much there is so far of what is wanted."""
        return min(self._there, self.wanted)

    @property
    def enough(self) -> bool:
        """Whether all is there that is wanted, or every case."""
        return self._there >= self.wanted or self._counted * self._study.chunk >= self._cases

    @property
    def rows(self) -> list[Row]:
        """The rows of the chunks that count, in order."""
        return [row for number in range(self._counted) for row in self._chunks[number]]

    def add(self, rows: Sequence[Row]) -> None:
        """Add the rows of a chunk; chunks beyond what is wanted do not count."""
        self._chunks[rows[0][0] // self._study.chunk] = rows
        while not self.enough and self._counted in self._chunks:
            self._there += self._study.counts(self._settings, self._chunks[self._counted])
            self._counted += 1

    def cases_of(self, chunk: int) -> range:
        """Return the numbers of the cases of a chunk; none beyond the last one."""
        first = chunk * self._study.chunk
        return range(first, min(first + self._study.chunk, self._cases))

    def missing(self) -> Iterator[Chunk]:
        """Yield the missing chunks, until there are rows enough."""
        text, there = self._settings.model_dump_json(), frozenset(self._chunks)
        last = -(-self._cases // self._study.chunk)
        for number in range(last):
            if self.enough:
                return
            if number not in there:
                cases = self.cases_of(number)
                yield Chunk(self._study.place, text, cases.start, cases.stop)


def _all_rows(
    files: StudyFiles[Settings, Row], settings: Settings, executor: Executor, progress: Progress
) -> list[Row]:
    study, found = files.study, files.complete_rows(settings)
    tally = Tally(study, settings)
    kept: list[Row] = []
    for number in sorted({number // study.chunk for number in found}):
        cases = tally.cases_of(number)
        if cases and all(case in found for case in cases):
            chunk = [row for case in cases for row in found[case]]
            kept += chunk
            tally.add(chunk)
    progress(tally.there, tally.wanted)
    if not tally.enough:
        files.replace_rows(kept)
        with closing(executor.stream(tally.missing())) as coming:
            for text in coming:
                if tally.enough:
                    # what was under way is left to finish, so that the processes are there for the next study
                    continue
                rows = study.table.read(text)
                files.append_rows(rows)
                tally.add(rows)
                progress(tally.there, tally.wanted)
    files.replace_rows(tally.rows)
    return tally.rows
