"""Runs the study and writes its tables, figures and page."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.pages.content import Table
from fivebar_bringup.pages.rendering import render
from fivebar_bringup.recorded.results import finite, new_directory
from fivebar_bringup.studies.common.study_directory import StudyDirectory
from fivebar_bringup.studies.engine.local import share
from fivebar_bringup.studies.robustness.effects import DRAWS, EFFECTS
from fivebar_bringup.studies.robustness.figures import share_figures
from fivebar_bringup.studies.robustness.running import (
    DURATIONS,
    EQUIPMENT,
    FAILURE_RULE,
    Climb,
    Ladder,
    climbed,
    failures_without,
)
from fivebar_bringup.studies.robustness.tables import causes_table, equipment_table, first_failures


class Robustness(NamedTuple):
    """Results of the study, and the page."""

    page: Path
    first: Table
    content: Mapping[str, Any]


class Extent(NamedTuple):
    """How much is run: names of effects and equipment, draws of each size, and durations of the crossing (s)."""

    effects: tuple[str, ...] = tuple(EFFECTS)
    equipment: tuple[str, ...] = tuple(EQUIPMENT)
    draws: int = DRAWS
    durations: tuple[float, ...] = DURATIONS

    def ladders(self) -> list[Ladder]:
        """Return the work, an effect after the other."""
        return [
            Ladder(effect, equipment, self.draws, self.durations)
            for effect in self.effects
            for equipment in self.equipment
            if EQUIPMENT[equipment].gyro or not EFFECTS[effect].needs_gyro
        ]


QUICK = Extent(draws=2, durations=(1.0,))


def robustness(
    extent: Extent,
    out: Path | None,
    workers: int,
    command: str = "fivebar robustness",
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> Robustness:
    """Run all of an extent, and write robustness.html, robustness.json and the figures.

    Args:
        extent: what is run.
        out: new or empty directory, by default runs/robustness-<date>-<time>.
        workers: processes to use; fewer than two run everything in this one.
        command: that repeats this study, for the page.
        progress: called with the number of finished pairs of effect and controller and of all.

    Raises:
        InputError: the directory cannot be used.
    """
    directory = StudyDirectory(new_directory(out, "robustness"), "robustness")
    # compiles the closed loop once, not in every process
    baseline = {one: failures_without(one, extent.draws, extent.durations) for one in extent.equipment}
    climbs = share(climbed, extent.ladders(), workers, progress)
    return _written(directory, extent, baseline, climbs, command)


def _written(
    directory: StudyDirectory, extent: Extent, baseline: dict[str, int], climbs: Sequence[Climb], command: str
) -> Robustness:
    first = first_failures(climbs)
    durations = ", ".join(f"{one:g}" for one in extent.durations)
    content = finite(
        {
            "command": command,
            "durations_s": extent.durations,
            "draws": extent.draws,
            "fails": FAILURE_RULE,
            "failures_without_effects": baseline,
            "first": first.as_json()["rows"],
            "climbs": [_as_json(climb) for climb in climbs],
        }
    )
    pictures = share_figures(climbs)
    page = render(
        "robustness.html",
        title="What must a robot be like?",
        setting=f"middle crossing in {durations} s · {extent.draws} draws each · simulated by the compiled engine",
        tables=[first, equipment_table(baseline)],
        details=[causes_table(climbs)],
        pictures=pictures,
        command=command,
    )
    directory.write(page, content, pictures)
    return Robustness(directory.page, first, content)


def _as_json(climb: Climb) -> dict[str, Any]:
    effect = EFFECTS[climb.effect]
    return {
        "effect": climb.effect,
        "controller": climb.equipment,
        "unit": effect.unit,
        "sizes": effect.sizes,
        "runs": climb.runs,
        "failed": climb.failed,
        "causes": climb.causes,
        "first_failure": climb.first_size,
    }
