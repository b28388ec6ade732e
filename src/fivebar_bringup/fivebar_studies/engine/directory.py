# SPDX-License-Identifier: Apache-2.0
"""The directory of a study: settings and incremental rows, from which an interrupted study resumes."""

from __future__ import annotations

import fcntl
import json
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any, Generic

from pydantic import ValidationError

from fivebar_bringup.pages.study_directory import StudyDirectory
from fivebar_bringup.recorded.results import finite, json_text, new_directory, write_results
from fivebar_description.files import LARGEST_TABLE, append_to_file, read_text, replace_file
from fivebar_description.strict_yaml import InputError
from fivebar_studies.engine.study import Settings, Study, StudyReport, case_numbers
from fivebar_studies.engine.table import Row

PROGRAM = "program"
"""Key of the digest of the code that decides the rows, beside the settings."""


class StudyFiles(Generic[Settings, Row]):
    """The files of a study: its JSON holds the settings from the start, and all results once it is finished."""

    def __init__(self, study: Study[Settings, Row], path: Path) -> None:
        self.study, self.path = study, path
        self.directory = StudyDirectory(path, study.name)
        self.rows = path / f"{study.name}.csv"
        """One line per row, in order of the cases."""

    def read_settings(self) -> tuple[Settings, str, bool]:
        """Return the settings of the study that was begun here, the digest of its program, and whether it is finished.

        Raises:
            InputError: there is none, or they cannot be read.
        """
        text = read_text(self.directory.content, LARGEST_TABLE)
        try:
            content = json.loads(text)
            settings = dict(content["settings"])
            program = str(settings.pop(PROGRAM))
            read = self.study.settings.model_validate_json(json.dumps(settings))
            return read, program, content.get("finished") is True
        except (ValidationError, ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
            raise InputError(f"{self.directory.content}: is not the file of a {self.study.name}") from error

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Hold the lock that keeps other studies from writing here.

        Raises:
            InputError: another one holds it.
        """
        with self.directory.content.open("rb") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                raise InputError(f"{self.path}: another {self.study.name} is writing here") from error
            yield

    def read_rows(self) -> list[Row]:
        """Return the rows of whole lines.

        Raises:
            InputError: the file holds something else.
        """
        if not self.rows.exists():
            return []
        table = self.study.table
        text = read_text(self.rows, LARGEST_TABLE)
        text = text[: text.rfind("\n") + 1]
        if text and not text.startswith(table.head):
            raise InputError(f"{self.rows}: begins with another line than that of this version's results")
        try:
            rows = table.read(text[len(table.head) :])
        except ValueError as error:
            raise InputError(f"{self.rows}: {error}") from error
        if case_numbers(rows) != [*range(len(case_numbers(rows)))]:
            raise InputError(f"{self.rows}: lacks cases, or has them in another order than it was written in")
        return rows

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
        content: dict[str, Any] = finite({**_begun_content(self.study, settings, True), **report.content})
        self.directory.write(report.page, content, report.pictures, report.others)
        return content


def _begun_content(study: Study[Settings, Row], settings: Settings, finished: bool) -> dict[str, Any]:
    return {"settings": {**settings.model_dump(), PROGRAM: study.program(settings)}, "finished": finished}


def opened(
    study: Study[Settings, Row], out: Path | None, arguments: Mapping[str, Any]
) -> tuple[StudyFiles[Settings, Row], Settings]:
    """Return the files of a new study, or of one to resume, with its settings.

    Args:
        study: which.
        out: new or empty directory, or that of a study; by default runs/NAME-<date>-<time>.
        arguments: settings; those that are None are those of the resumed study, else their defaults.

    Raises:
        InputError: the directory cannot be used, or holds a study with other settings.
    """
    if out is not None and StudyDirectory(out, study.name).content.is_file():
        begun = StudyFiles(study, out)
        settings, program, _ = begun.read_settings()
        kept = {**settings.model_dump(), PROGRAM: program}
        for name, value in {**arguments, PROGRAM: study.program(settings)}.items():
            if value is not None and value != kept[name]:
                raise InputError(
                    f"{out}: holds a {study.name} with {name} {_words(kept[name])}, not {_words(value)}: expected the"
                    " same or another directory"
                )
        return begun, settings
    settings = study.settings_with(arguments)
    # what is refused leaves no directory
    content = json_text(_begun_content(study, settings, False))
    new = StudyFiles(study, new_directory(out, study.name))
    write_results(new.path, {new.directory.content.name: content})
    return new, settings


def _words(value: Any) -> str:
    return ", ".join(map(str, value)) if isinstance(value, tuple) else str(value)
