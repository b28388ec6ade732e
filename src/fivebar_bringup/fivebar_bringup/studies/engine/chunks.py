"""A chunk of cases as a task for another process or machine: plain data in, plain data out."""

from __future__ import annotations

from importlib import import_module
from typing import Any, NamedTuple

from fivebar_bringup.studies.engine.study import Study


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


def defined(place: str) -> Study[Any, Any]:
    """Return the study that is defined at a place, `MODULE:NAME`."""
    module, _, name = place.partition(":")
    study: Study[Any, Any] = getattr(import_module(module), name)
    return study
