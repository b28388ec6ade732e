"""Commands or samples that are lost in a burst, at every moment of a crossing: the worst error over the moment."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from enum import StrEnum
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.pages.style import BLUE, GREEN, GREY, INK, PURPLE, VERMILION, house_style, new_figure, png
from fivebar_bringup.recorded.results import json_text, new_directory, write_results
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.studies.engine.local import share
from fivebar_bringup.studies.robustness.running import FAR, cause_of, prepared
from fivebar_bringup.studies.sweep.drawing import RATE_HZ
from fivebar_control.estimation.readings import longest_gap


class Lost(StrEnum):
    """What does not arrive: the commands of some samples at the drives, or these samples at the control chain."""

    COMMANDS = "commands"
    SAMPLES = "samples"


LIMIT = longest_gap(RATE_HZ)
"""Periods for which a torque is held by default at this rate, and after which an estimate without readings is lost."""

BURSTS = {Lost.COMMANDS: (1, 5, LIMIT, 15), Lost.SAMPLES: (1, 5, LIMIT - 1)}
"""How many are lost one after the other. The readings after the last burst of samples are the limit after those before:
with one more missing the estimator gives up."""

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
        lost: what is lost.
        crossing: when the platform is on the locus (s).
        moments: [n], when a burst begins (s).
        errors: [len(BURSTS[lost]), n], largest distance from the reference (m), NaN where the run fails otherwise.
        without: the same without a loss (m).
        failures: of each burst, how many runs fail by a fault or end in the wrong assembly mode.
    """

    equipment: str
    lost: Lost
    crossing: float
    moments: FloatArray
    errors: FloatArray
    without: float
    failures: tuple[int, ...]

    @property
    def worst(self) -> tuple[float, ...]:
        """The largest of all errors (m), for each burst."""
        return tuple(float(np.nanmax(row)) for row in self.errors)

    def as_json(self) -> dict[str, Any]:
        """Return the worst of all moments, and when it is, for each burst."""
        return {
            "equipment": self.equipment,
            "of": self.lost.value,
            "without_m": self.without,
            "lost": BURSTS[self.lost],
            "worst_m": self.worst,
            "at_s": [float(self.moments[int(np.nanargmax(row))]) for row in self.errors],
            "failures": self.failures,
        }


class LossSeries(NamedTuple):
    """Work for one process: an equipment, and what it loses."""

    equipment: str
    lost: Lost


def losses_of(series: LossSeries, every: int = EVERY) -> Losses:
    """Return what becomes of a crossing when a burst begins at every `every`-th sample, never at the first one."""
    scenario, samples = prepared(series.equipment, DURATION)
    plan, case = scenario.plan(), case_of(scenario, stop_at_fault=True)
    none = np.zeros_like(case.numbers.lost)
    # without sample 0 there is no run
    first = np.arange(0 if series.lost is Lost.COMMANDS else every, plan.path.samples(RATE_HZ), every)

    def run(start: int, burst: int) -> float:
        lost = none.copy()
        lost[start : start + burst] = True
        numbers = case.numbers
        numbers = numbers._replace(lost=lost) if series.lost is Lost.COMMANDS else numbers._replace(missing=lost)
        outcome = crossing(case._replace(numbers=numbers), samples)
        failed = cause_of(outcome, len(plan.crossings)) not in (None, FAR)
        return float("nan") if failed else outcome.error_peak

    errors = np.array([[run(start, burst) for start in first.tolist()] for burst in BURSTS[series.lost]])
    failures = tuple(int(count) for count in np.isnan(errors).sum(axis=1))
    return Losses(*series, plan.crossings[0].time, first / RATE_HZ, errors, run(0, 0), failures)


def losses_figure(losses: Sequence[Losses]) -> Figure:
    """Draw the worst error over the moment of the loss, a panel for each burst: commands left, samples right."""
    figure = new_figure(
        "Lost commands and lost samples",
        "largest distance from the reference when so many in a row are lost from a moment on",
        8.0,
    )
    panels = figure.subplots(max(map(len, BURSTS.values())), len(BURSTS), sharex=True, sharey=True)
    for column, (lost, bursts) in enumerate(BURSTS.items()):
        shown = [one for one in losses if one.lost is lost]
        for row in range(len(bursts)):
            _panel(panels[row, column], shown, row)
        last = panels[len(bursts) - 1, column]
        last.set_xlabel("moment of the loss in s")
        last.tick_params(labelbottom=True)
    for axes in panels[:, 0]:
        axes.set_ylabel("mm")
    _explain(panels[-1, -1], panels[0, 0])
    return figure


def _panel(axes: Axes, losses: Sequence[Losses], row: int) -> None:
    """Draw one burst of all equipment."""
    for one in losses:
        axes.plot(one.moments, one.errors[row] * 1e3, color=FOLLOWERS[one.equipment], label=one.equipment, lw=1.2)
    burst, lost = BURSTS[losses[0].lost][row], losses[0].lost
    axes.axvline(losses[0].crossing, color=INK, linewidth=0.9, linestyle=":")
    axes.axhline(2.0, color=GREY, linewidth=0.9)
    axes.set_yscale("log")
    axes.set_title(f"{burst} {lost if burst > 1 else lost.removesuffix('s')}, {burst * 1e3 / RATE_HZ:g} ms")


def _explain(free: Axes, drawn: Axes) -> None:
    """Put into the free panel what the lines are, and why there is nothing to draw."""
    free.set_axis_off()
    free.legend(*drawn.get_legend_handles_labels(), loc="upper center", ncols=2)
    note = f"{LIMIT} samples and more: stopped with estimate_lost\ndotted: on the locus; grey: tolerance of 2 mm"
    free.text(0.5, 0.1, note, transform=free.transAxes, ha="center")


def write_losses(
    out: Path | None, workers: int, progress: Callable[[int, int], None] = lambda done, total: None
) -> tuple[Path, list[Losses]]:
    """Run the study, write losses.json and the figure into a directory, and return it with the results.

    Raises:
        InputError: the directory cannot be used.
    """
    directory = new_directory(out, "losses")
    losses = share(losses_of, [LossSeries(name, lost) for lost in Lost for name in FOLLOWERS], workers, progress)
    with house_style():
        picture = png(losses_figure(losses))
    content = {"duration_s": DURATION, "rate_hz": RATE_HZ, "losses": [one.as_json() for one in losses]}
    write_results(directory, {"losses.json": json_text(content)}, {"losses": picture})
    return directory, losses
