"""Commands that are lost in a burst, at every moment of a crossing: the worst error over the moment."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.figure import Figure

from fivebar_bringup.pages.style import BLUE, GREEN, GREY, INK, PURPLE, VERMILION, house_style, new_figure, png
from fivebar_bringup.runs.bag.recording import FloatArray
from fivebar_bringup.runs.results import json_text, new_directory, write_results
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.studies.robustness.running import FAR, cause_of, prepared
from fivebar_bringup.studies.shared_work import share
from fivebar_bringup.studies.sweep.drawing import RATE_HZ

BURSTS = (1, 5, 10, 15)
"""Commands that are lost one after the other; the third is what is held by default at this rate."""

FOLLOWERS = {
    "unified, encoders": BLUE,
    "unified, gyro": GREEN,
    "multi_cartesian, encoders": VERMILION,
    "multi_joint, encoders": PURPLE,
}
"""Equipment, and its colour in the figure."""

EVERY = 2
"""Samples from one moment to the next."""

DURATION = 1.0
"""Of the crossing (s)."""


class Losses(NamedTuple):
    """The errors of an equipment.

    Attributes:
        equipment: its name.
        crossing: when the platform is on the locus (s).
        moments: [n], when the first command of a burst is lost (s).
        errors: [len(BURSTS), n], largest distance from the reference (m), NaN where the run fails otherwise.
        without: the same without a loss (m).
        failures: of each burst, how many runs fail by a fault or end in the wrong assembly mode.
    """

    equipment: str
    crossing: float
    moments: FloatArray
    errors: FloatArray
    without: float
    failures: tuple[int, ...]

    def as_json(self) -> dict[str, Any]:
        """Return the worst of all moments, and when it is, for each burst."""
        worst = [int(np.nanargmax(row)) for row in self.errors]
        return {
            "equipment": self.equipment,
            "without_m": self.without,
            "lost": BURSTS,
            "worst_m": [float(row[one]) for row, one in zip(self.errors, worst, strict=True)],
            "at_s": [float(self.moments[one]) for one in worst],
            "failures": self.failures,
        }


def losses_of(equipment: str, every: int = EVERY) -> Losses:
    """Return what becomes of a crossing when commands are lost from every `every`-th sample on."""
    scenario, samples = prepared(equipment, DURATION)
    plan, case = scenario.plan(), case_of(scenario, stop_at_fault=True)
    none = np.zeros_like(case.numbers.lost)
    first = np.arange(0, plan.path.samples(RATE_HZ), every)

    def run(start: int, burst: int) -> float:
        lost = none.copy()
        lost[start : start + burst] = True
        outcome = crossing(case._replace(numbers=case.numbers._replace(lost=lost)), samples)
        failed = cause_of(outcome, len(plan.crossings)) not in (None, FAR)
        return float("nan") if failed else outcome.error_peak

    errors = np.array([[run(start, burst) for start in first.tolist()] for burst in BURSTS])
    failures = tuple(int(count) for count in np.isnan(errors).sum(axis=1))
    return Losses(equipment, plan.crossings[0].time, first / RATE_HZ, errors, run(0, 0), failures)


def losses_figure(losses: list[Losses]) -> Figure:
    """Draw the worst error over the moment of the loss, a panel for each burst."""
    figure = new_figure(
        "Lost commands",
        "largest distance from the reference when so many commands in a row are lost from a moment on",
        8.0,
    )
    panels = figure.subplots(len(BURSTS), 1, sharex=True, sharey=True)
    for row, (axes, burst) in enumerate(zip(panels, BURSTS, strict=True)):
        for one in losses:
            axes.plot(one.moments, one.errors[row] * 1e3, color=FOLLOWERS[one.equipment], label=one.equipment, lw=1.2)
        axes.axvline(losses[0].crossing, color=INK, linewidth=0.9, linestyle=":")
        axes.axhline(2.0, color=GREY, linewidth=0.9)
        axes.set_yscale("log")
        axes.set_ylabel("mm")
        axes.set_title(f"{burst} lost, {burst * 1e3 / RATE_HZ:g} ms")
    panels[0].legend(ncols=2)
    panels[-1].set_xlabel("moment of the loss in s; dotted: on the locus; grey: tolerance of 2 mm")
    return figure


def write_losses(
    out: Path | None, workers: int, progress: Callable[[int, int], None] = lambda done, total: None
) -> tuple[Path, list[Losses]]:
    """Run the study, write losses.json and the figure into a directory, and return it with the results.

    Raises:
        InputError: the directory cannot be used.
    """
    directory = new_directory(out, "losses")
    losses = share(losses_of, list(FOLLOWERS), workers, progress)
    with house_style():
        picture = png(losses_figure(losses))
    content = {"duration_s": DURATION, "rate_hz": RATE_HZ, "losses": [one.as_json() for one in losses]}
    write_results(directory, {"losses.json": json_text(content)}, {"losses": picture})
    return directory, losses
