"""A chunk of cases as a task for another process or machine: plain data in, plain data out."""

from __future__ import annotations

from functools import lru_cache
from typing import Any, NamedTuple

from fivebar_bringup.studies.engine.study import Study
from fivebar_description.modules import load_part


class Chunk(NamedTuple):
    """Cases of a study.

    Attributes:
        study: where the study is defined, `MODULE:NAME`.
        settings: of the study, as JSON.
        first, end: numbers of the cases, from `first` to before `end`.
    """

    study: str
    settings: str
    first: int
    end: int


def run_chunk(chunk: Chunk) -> str:
    """Return the rows of a chunk as lines of comma-separated values, in order of the cases."""
    study = defined(chunk.study)
    settings = study.settings.model_validate_json(chunk.settings)
    return study.table.lines(row for number in range(chunk.first, chunk.end) for row in study.run(settings, number))


@lru_cache(maxsize=8)
def program_of(study: str, settings: str) -> str:
    """Return the digest of what decides the rows of a chunk with this study and settings, found once in a process."""
    found = defined(study)
    return found.program(found.settings.model_validate_json(settings))


def defined(place: str) -> Study[Any, Any]:
    """Return the study that is defined at a place, `MODULE:NAME`."""
    study: Study[Any, Any] = load_part(place)
    return study
