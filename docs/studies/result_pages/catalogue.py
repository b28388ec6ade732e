# SPDX-License-Identifier: Apache-2.0
"""All sections of the page of results, and the studies that are run for them."""

from __future__ import annotations

from typing import Any

from result_pages import (
    comparison,
    crossing,
    exact,
    faults,
    laws,
    odds,
    rigs,
    sensors,
    survived,
    thesis,
)
from result_pages.page import ResultPage, StudyRun

RUNS: dict[str, StudyRun] = {
    run.name: run
    for module in (rigs, laws, exact, faults, survived, sensors, comparison, crossing, thesis)
    for run in module.RUNS
}
"""The runs by name, in the order in which they are made."""


def whole_sample(name: str) -> int:
    """Return how large the whole sample of a run is."""
    study, settings = RUNS[name].loaded()
    return study.needed(settings)


PAGES: tuple[ResultPage[Any], ...] = (
    rigs.RIGS,
    odds.ODDS,
    laws.LAWS,
    exact.EXACT,
    faults.FAULTS,
    survived.SURVIVED,
    sensors.SENSORS,
    comparison.COMPARISON,
    crossing.CROSSING,
    thesis.THESIS,
)
