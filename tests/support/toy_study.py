"""A study without work, which other processes find by its place."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_bringup.studies.engine.study import Study, StudyReport, StudySettings
from fivebar_bringup.studies.engine.table import RowTable


class ToySettings(StudySettings):
    """Cases, and what is in their rows."""

    cases: int = 1
    value: float = 1.0


class ToyCase(NamedTuple):
    """A case of the toy study."""

    case: int
    value: float


TOY = Study(
    name="toy",
    place=f"{__name__}:TOY",
    settings=ToySettings,
    table=RowTable(ToyCase),
    run=lambda settings, number: [ToyCase(number, settings.value)],
    cases=lambda settings: settings.cases,
    chunk=1,
    report=lambda settings, rows: StudyReport("page", {}, []),
    program=lambda settings: "0123",
    command=lambda settings: f"toy --cases {settings.cases} --value {settings.value:g}",
)
