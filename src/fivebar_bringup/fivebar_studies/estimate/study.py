# SPDX-License-Identifier: Apache-2.0
"""Definition of the comparison of estimates as a study: the recorded settings are one case, changed ones another."""

from __future__ import annotations

import hashlib
import shlex
from collections.abc import Sequence
from functools import lru_cache
from pathlib import Path
from typing import NamedTuple

from fivebar_studies.engine.program import program_digest
from fivebar_studies.engine.study import Study, StudyReport, StudySettings
from fivebar_studies.engine.table import RowTable
from fivebar_studies.estimate.estimate import EstimationComparison, estimate_bag


class EstimationSettings(StudySettings):
    """The settings that determine the rows of a comparison of estimates.

    Attributes:
        bag: that is estimated again, or the directory of its run.
        changes: single settings, `KEY=VALUE`.
        file: YAML with sections `ekf` and `tolerances`, or a whole scenario; "" for none.
        scenario: of a bag that lies in no run, "" for that of the run.
        namespace: of the topics, None for the one that the bag has.
    """

    bag: str = ""
    changes: tuple[str, ...] = ()
    file: str = ""
    scenario: str = ""
    namespace: str | None = None


class EstimationRow(NamedTuple):
    """A line of estimation.csv: how consistent the estimate is; nothing for a sensor that is not there.

    Attributes:
        case: 0 with the recorded settings, 1 with the changed ones.
        samples: that were estimated.
        innovations_encoders, innovations_gyro, innovations_elbow: mean square in units of the variance, 1 expected.
        innovations_encoders_max, innovations_gyro_max, innovations_elbow_max: the largest of a sample.
        nees_position, nees_velocity: normalised squared errors, 2 expected.
        estimate_error_max_m: largest distance from the exact position.
        difference_max_m: largest distance from the recorded estimate.
        identical: whether it equals the recorded estimate, bit for bit.
        fault: the first, empty for none.
    """

    case: int
    samples: int
    innovations_encoders: float | None
    innovations_encoders_max: float | None
    innovations_gyro: float | None
    innovations_gyro_max: float | None
    innovations_elbow: float | None
    innovations_elbow_max: float | None
    nees_position: float | None
    nees_velocity: float | None
    estimate_error_max_m: float | None
    difference_max_m: float | None
    identical: bool
    fault: str


@lru_cache(maxsize=2)
def compared(settings: EstimationSettings) -> EstimationComparison:
    """Return a bag estimated with the recorded settings and with others; raises what `estimate_bag` does."""
    file = Path(settings.file) if settings.file else None
    scenario = Path(settings.scenario) if settings.scenario else None
    return estimate_bag(Path(settings.bag), file, settings.changes, scenario, settings.namespace)


def run_numbered(settings: EstimationSettings, number: int) -> list[EstimationRow]:
    """Return the row of the recorded settings or of the changed ones."""
    comparison = compared(settings)
    return [EstimationRow(number, **(comparison.before, comparison.after)[number].as_json())]


def estimation_report(settings: EstimationSettings, rows: Sequence[EstimationRow]) -> StudyReport:
    """Return figure, page, and the new settings as a file."""
    # here, because matplotlib takes as long to load as all the rest of the command
    from fivebar_studies.estimate.page import SETTINGS_FILE, draw_pictures, html_page, settings_file

    comparison = compared(settings)
    pictures, others = draw_pictures(comparison), {SETTINGS_FILE: settings_file(comparison)}
    return StudyReport(html_page(comparison, pictures), comparison.as_json(), pictures, comparison, others)


def command_of(settings: EstimationSettings) -> str:
    """Return the command that repeats a comparison."""
    words = ["fivebar", "estimate", settings.bag]
    for change in settings.changes:
        words += ["--set", change]
    for option, value in (
        ("--settings", settings.file),
        ("--scenario", settings.scenario),
        ("--namespace", settings.namespace),
    ):
        words += [option, value] if value else []
    return shlex.join(words)


def _program(settings: EstimationSettings) -> str:
    comparison = compared(settings)
    total = hashlib.sha256(program_digest(DECIDING, scenarios=(comparison.recorded, comparison.changed)).encode())
    for path in sorted(comparison.bag.rglob("*")) if comparison.bag.is_dir() else [comparison.bag]:
        if path.is_file():
            with path.open("rb") as file:
                total.update(hashlib.file_digest(file, "sha256").digest())
    return total.hexdigest()[:16]


DECIDING = (
    "fivebar_bringup/recorded/*.py",
    "fivebar_bringup/bag/*.py",
    "fivebar_studies/estimate/*.py",
    "fivebar_bringup/identify/reading.py",
)
"""Files that decide the rows besides those of every study."""

ESTIMATION = Study(
    name="estimation",
    place=f"{__name__}:ESTIMATION",
    settings=EstimationSettings,
    table=RowTable(EstimationRow),
    run=run_numbered,
    cases=lambda settings: 2,
    chunk=lambda settings: 1,
    report=estimation_report,
    program=_program,
    command=command_of,
)
"""The study of a recorded motion estimated with other settings."""
