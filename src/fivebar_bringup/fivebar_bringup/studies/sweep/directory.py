"""The directory of a sweep: settings and incremental results, from which an interrupted sweep resumes."""

from __future__ import annotations

import fcntl
import json
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import NamedTuple

from fivebar_bringup.recorded.results import json_text, new_directory, write_results
from fivebar_bringup.studies.common.study_directory import StudyDirectory
from fivebar_bringup.studies.sweep.drawing import VARIED
from fivebar_bringup.studies.sweep.program import program_digest
from fivebar_bringup.studies.sweep.rows import HEAD, SweepRow, as_lines, from_lines
from fivebar_bringup.studies.sweep.running import SWEPT
from fivebar_control.laws.registry import CONTROLLERS
from fivebar_description.strict_yaml import InputError
from fivebar_description.text_file import LARGEST_TABLE, append_to_file, read_text, replace_file

DEFAULT_SEED, DEFAULT_CASES = 1, 2000


class SweepSettings(NamedTuple):
    """The settings that determine the results of a sweep.

    Attributes:
        seed: of all cases.
        cases: crossings judged feasible for the controller that counts (:func:`counted`) after which the sweep is done.
        program: digest of the code that decides the rows.
        rig: whose robots are drawn, by name or by the path of its file, "" for none.
        controllers: that make each crossing.
    """

    seed: int
    cases: int
    program: str
    rig: str = VARIED
    controllers: tuple[str, ...] = SWEPT


class SweepDirectory(StudyDirectory):
    """The directory of a sweep: its JSON holds the settings from the start, and all results once it is finished."""

    def __init__(self, path: Path) -> None:
        super().__init__(path, "sweep")

    @property
    def rows(self) -> Path:
        """One line per run and refused case: in order of completion, and sorted in the end."""
        return self.path / "sweep.csv"

    def read_settings(self) -> SweepSettings:
        """Return the settings of the sweep that was started here.

        Raises:
            InputError: there is none, or they cannot be read.
        """
        try:
            content = json.loads(read_text(self.content, LARGEST_TABLE))["settings"]
            return SweepSettings(
                int(content["seed"]),
                int(content["cases"]),
                str(content["program"]),
                str(content["rig"]),
                _controllers(content["controllers"]),
            )
        except InputError:
            raise
        except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as error:
            raise InputError(f"{self.content}: is not the file of a sweep") from error

    @contextmanager
    def alone(self) -> Iterator[None]:
        """Hold the lock that keeps other sweeps from writing here.

        Raises:
            InputError: another sweep holds it.
        """
        with self.content.open("rb") as file:
            try:
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except OSError as error:
                raise InputError(f"{self.path}: another sweep is writing here") from error
            yield

    def complete_rows(self, controllers: tuple[str, ...] = SWEPT) -> dict[int, list[SweepRow]]:
        """Return the rows of each case that has those of all controllers; one with a torn last line is left out.

        Raises:
            InputError: the file holds something else.
        """
        if not self.rows.exists():
            return {}
        text = read_text(self.rows, LARGEST_TABLE)
        text = text[: text.rfind("\n") + 1]
        if text and not text.startswith(HEAD):
            raise InputError(f"{self.rows}: begins with another line than that of this version's results")
        by_case: dict[int, list[SweepRow]] = {}
        try:
            for row in from_lines(text[len(HEAD) :]):
                by_case.setdefault(row.case, []).append(row)
        except ValueError as error:
            raise InputError(f"{self.rows}: {error}") from error
        return {number: rows for number, rows in by_case.items() if _is_complete(rows, controllers)}

    def replace_rows(self, rows: Sequence[SweepRow]) -> None:
        """Write these rows and no others, in one step."""
        replace_file(self.rows, (HEAD + as_lines(rows)).encode("utf-8"))

    def append_rows(self, rows: Sequence[SweepRow]) -> None:
        """Append rows; they are with the operating system when this returns."""
        append_to_file(self.rows, as_lines(rows).encode("utf-8"))


def opened(
    out: Path | None,
    seed: int | None,
    cases: int | None,
    rig: str | None = None,
    controllers: tuple[str, ...] | None = None,
) -> tuple[SweepDirectory, SweepSettings]:
    """Return a new sweep's directory, or that of one to resume, with its settings.

    Args:
        out: new or empty directory, or that of a sweep; by default runs/sweep-<date>-<time>.
        seed: by default that of the resumed sweep, else 1.
        cases: by default those of the resumed sweep, else 2000.
        rig: by default that of the resumed sweep, else none.
        controllers: by default those of the resumed sweep, else `SWEPT`.

    Raises:
        InputError: the directory cannot be used, or holds a sweep with other settings.
    """
    if out is not None and SweepDirectory(out).content.is_file():
        begun = SweepDirectory(out)
        settings = begun.read_settings()
        wanted = {
            "seed": seed,
            "cases": cases,
            "rig": rig,
            "program": program_digest(settings.rig),
            "controllers": controllers,
        }
        for name, value in wanted.items():
            found = getattr(settings, name)
            if value is not None and value != found:
                theirs, ours = (", ".join(one) if isinstance(one, tuple) else one for one in (found, value))
                raise InputError(
                    f"{out}: holds a sweep with {name} {theirs}, not {ours}: expected the same or another directory"
                )
        return begun, settings
    new = SweepDirectory(new_directory(out, "sweep"))
    settings = SweepSettings(
        DEFAULT_SEED if seed is None else seed,
        DEFAULT_CASES if cases is None else cases,
        program_digest(VARIED if rig is None else rig),
        VARIED if rig is None else rig,
        SWEPT if controllers is None else controllers,
    )
    write_results(new.path, {new.content.name: json_text({"settings": settings._asdict(), "finished": False})})
    return new, settings


def _controllers(names: Iterable[str]) -> tuple[str, ...]:
    """Return the names of a sweep's controllers.

    Raises:
        ValueError: there are none, or one that is not known.
    """
    found = tuple(names)
    if not found or not set(found) <= set(CONTROLLERS):
        raise ValueError(f"{found}: expected some of {', '.join(CONTROLLERS)}")
    return found


def _is_complete(rows: Sequence[SweepRow], controllers: tuple[str, ...]) -> bool:
    """Return whether these are all rows of a case."""
    names = tuple(row.controller for row in rows)
    return names in (("",), controllers)
