"""The directory of a study: settings and incremental rows, from which an interrupted study resumes."""

from __future__ import annotations

import fcntl
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Generic

from pydantic import ValidationError

from fivebar_bringup.recorded.results import finite, json_text, new_directory, write_results
from fivebar_bringup.studies.engine.study import Settings, Study, StudyReport
from fivebar_bringup.studies.engine.table import Row
from fivebar_bringup.studies.study_directory import StudyDirectory
from fivebar_description.files import LARGEST_TABLE, append_to_file, read_text, replace_file
from fivebar_description.strict_yaml import InputError

PROGRAM = "program"
"""Key of the digest of the code that decides the rows, beside the settings."""


class StudyFiles(Generic[Settings, Row]):
    """The files of a study: its JSON holds the settings from the start, and all results once it is finished."""

    def __init__(self, study: Study[Settings, Row], path: Path) -> None:
        self.study, self.path = study, path
        self.directory = StudyDirectory(path, study.name)

    @property
    def page(self) -> Path:
        """The page to look at."""
        return self.directory.page

    @property
    def content(self) -> Path:
        """Settings, and all results."""
        return self.directory.content

    @property
    def rows(self) -> Path:
        """One line per row: in order of completion, and sorted in the end."""
        return self.path / f"{self.study.name}.csv"

    def read_settings(self) -> tuple[Settings, str]:
        """Return the settings of the study that was started here, and the digest of its program.

        Raises:
            InputError: there is none, or they cannot be read.
        """
        text = read_text(self.content, LARGEST_TABLE)
        try:
            content = dict(json.loads(text)["settings"])
            program = str(content.pop(PROGRAM))
            return self.study.settings.model_validate_json(json.dumps(content)), program
        except (ValidationError, ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
            raise InputError(f"{self.content}: is not the file of a {self.study.name}") from error

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Hold the lock that keeps other studies from writing here.

        Raises:
            InputError: another one holds it.
        """
        with self.content.open("rb") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                raise InputError(f"{self.path}: another {self.study.name} is writing here") from error
            yield

    def complete_rows(self, settings: Settings) -> dict[int, list[Row]]:
        """Return the rows of each case that has all of them; one with a torn last line is left out.

        Raises:
            InputError: the file holds something else.
        """
        if not self.rows.exists():
            return {}
        table = self.study.table
        text = read_text(self.rows, LARGEST_TABLE)
        text = text[: text.rfind("\n") + 1]
        if text and not text.startswith(table.head):
            raise InputError(f"{self.rows}: begins with another line than that of this version's results")
        by_case: dict[int, list[Row]] = {}
        try:
            for row in table.read(text[len(table.head) :]):
                by_case.setdefault(row[0], []).append(row)
        except ValueError as error:
            raise InputError(f"{self.rows}: {error}") from error
        return {number: rows for number, rows in by_case.items() if self.study.complete(settings, rows)}

    def replace_rows(self, rows: Sequence[Row]) -> None:
        """Write these rows and no others, in one step."""
        table = self.study.table
        replace_file(self.rows, (table.head + table.lines(rows)).encode("utf-8"))

    def append_rows(self, rows: Sequence[Row]) -> None:
        """Append rows; they are with the operating system when this returns."""
        append_to_file(self.rows, self.study.table.lines(rows).encode("utf-8"))

    def write(self, settings: Settings, rows: Sequence[Row], report: StudyReport) -> Mapping[str, Any]:
        """Write the rows in their other forms, results, figures and page, and return the results.

        Raises:
            InputError: the directory cannot be written to.
        """
        files: dict[str, str | bytes] = {f"{self.study.name}.schema.json": json_text(self.study.table.schema())}
        parquet = self.study.table.parquet(rows)
        if parquet is not None:
            files[f"{self.study.name}.parquet"] = parquet
        write_results(self.path, files)
        content: dict[str, Any] = finite({**begun_content(self.study, settings, True), **report.content})
        self.directory.write(report.page, content, report.pictures, report.others)
        return content


def _words(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)


def begun_content(study: Study[Settings, Row], settings: Settings, finished: bool) -> dict[str, Any]:
    """Return what the JSON of a study says from its start."""
    return {"settings": {**settings.model_dump(), PROGRAM: study.program(settings)}, "finished": finished}


def opened(
    study: Study[Settings, Row], out: Path | None, given: Mapping[str, Any]
) -> tuple[StudyFiles[Settings, Row], Settings]:
    """Return the files of a new study, or of one to resume, with its settings.

    Args:
        study: which.
        out: new or empty directory, or that of a study; by default runs/NAME-<date>-<time>.
        given: settings; those that are None are those of the resumed study, else their defaults.

    Raises:
        InputError: the directory cannot be used, or holds a study with other settings.
    """
    if out is not None and StudyFiles(study, out).content.is_file():
        begun = StudyFiles(study, out)
        settings, program = begun.read_settings()
        found = {**settings.model_dump(), PROGRAM: program}
        for name, value in {**given, PROGRAM: study.program(settings)}.items():
            if value is not None and value != found[name]:
                raise InputError(
                    f"{out}: holds a {study.name} with {name} {_words(found[name])}, not {_words(value)}: expected the"
                    " same or another directory"
                )
        return begun, settings
    new = StudyFiles(study, new_directory(out, study.name))
    settings = study.settings_with(given)
    write_results(new.path, {new.content.name: json_text(begun_content(study, settings, False))})
    return new, settings
