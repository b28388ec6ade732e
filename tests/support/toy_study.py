# SPDX-License-Identifier: Apache-2.0
"""A study without work, which other processes find by its place."""

from __future__ import annotations

import os
import signal
from pathlib import Path
from typing import NamedTuple

from fivebar_studies.engine.study import Study, StudyReport, StudySettings
from fivebar_studies.engine.table import RowTable

DEADLY = 5


class ToySettings(StudySettings):
    """Cases, what is in their rows, and a folder with a file for each time that case 5 kills its process."""

    cases: int = 1
    value: float = 1.0
    deaths: str = ""


class ToyCase(NamedTuple):
    """A case of the toy study."""

    case: int
    value: float


def run_case(settings: ToySettings, number: int) -> list[ToyCase]:
    """Return the row of a case."""
    if settings.deaths and number == DEADLY:
        for death in Path(settings.deaths).iterdir():
            death.unlink()
            os.kill(os.getpid(), signal.SIGKILL)
    return [ToyCase(number, settings.value)]


TOY = Study(
    name="toy",
    place=f"{__name__}:TOY",
    settings=ToySettings,
    table=RowTable(ToyCase),
    run=run_case,
    cases=lambda settings: settings.cases,
    chunk=lambda settings: 1,
    report=lambda settings, rows: StudyReport("page", {}, []),
    program=lambda settings: "0123",
    command=lambda settings: f"toy --cases {settings.cases} --value {settings.value:g}",
)
