"""Commands or samples that are lost in a burst, at every moment of a crossing: the worst error over the moment."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from enum import StrEnum
from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.pages.content import Cell, Picture, Table
from fivebar_bringup.pages.rendering import study_page
from fivebar_bringup.pages.style import BLUE, GREEN, GREY, INK, PURPLE, VERMILION, house_style, new_figure, png
from fivebar_bringup.simulation.case import case_of
from fivebar_bringup.simulation.engine import crossing
from fivebar_bringup.studies.engine.program import program_digest
from fivebar_bringup.studies.engine.study import Study, StudyReport, StudySettings
from fivebar_bringup.studies.engine.table import RowTable
from fivebar_bringup.studies.robustness.robustness import RIGS
from fivebar_bringup.studies.robustness.running import FAR, RobustnessSettings, cause_of, prepared
from fivebar_bringup.studies.sweep.drawing import RATE_HZ, ROBOT
from fivebar_bringup.studies.sweep.sweep import DECIDING
from fivebar_control.estimation.readings import longest_gap
from fivebar_description.rounding import in_millimetres


class Lost(StrEnum):
    """Losses: the commands of some samples at the drives, or these samples at the control chain."""

    COMMANDS = "commands"
    SAMPLES = "samples"


LIMIT = longest_gap(RATE_HZ)
"""Periods for which a torque is held by default at this rate, and after which an estimate without readings is lost."""

BURSTS = {Lost.COMMANDS: (1, 5, LIMIT, 15), Lost.SAMPLES: (1, 5, LIMIT - 1)}
"""How many are lost one after the other. The readings after the last burst of samples are the limit after those before:
with one more missing the estimator gives up."""

COLOURS = (BLUE, GREEN, VERMILION, PURPLE)
"""In the figure, in turn."""

DURATION = 1.0
"""Duration of the crossing (s)."""


class LossSettings(StudySettings):
    """The settings that determine the rows of the study.

    Attributes:
        controllers: each from encoders alone, `unified` also with a gyroscope.
        every: samples from one moment to the next.
    """

    controllers: tuple[str, ...] = RobustnessSettings().controllers
    every: int = 2


class LossSeries(NamedTuple):
    """A case: an equipment, what it loses, and how many in a row, 0 for none."""

    equipment: str
    lost: Lost
    burst: int


class LossRow(NamedTuple):
    """A line of losses.csv: a run in which a burst is lost.

    Attributes:
        case: number of the equipment, of what is lost, and of how many.
        equipment: controller and sensors.
        lost: commands or samples.
        burst: how many in a row, 0 for none.
        moment: when it begins (s).
        error: largest distance from the reference (m); empty where the run fails otherwise.
        cause: why it fails, "" where it does not.
    """

    case: int
    equipment: str
    lost: str
    burst: int
    moment: float
    error: float | None
    cause: str


def series_of(settings: LossSettings) -> tuple[LossSeries, ...]:
    """Return the cases of the study."""
    equipment = []
    for controller in settings.controllers:
        equipment += [f"{controller}, encoders", *(["unified, gyro"] if controller == "unified" else [])]
    pairs = itertools.product(Lost, equipment)
    return tuple(LossSeries(name, lost, burst) for lost, name in pairs for burst in (0, *BURSTS[lost]))


def run_numbered(settings: LossSettings, number: int) -> list[LossRow]:
    """Return the rows of a case: a burst begins at every `every`-th sample, never at the first one."""
    series = series_of(settings)[number]
    scenario, samples = prepared(series.equipment, DURATION)
    plan, case = scenario.plan(), case_of(scenario, stop_at_fault=True)
    # without sample 0 there is no run
    first = 0 if series.lost is Lost.COMMANDS else settings.every
    rows = []
    for start in range(first, plan.path.samples(RATE_HZ), settings.every) if series.burst else (0,):
        lost = np.zeros_like(case.numbers.lost)
        lost[start : start + series.burst] = True
        numbers = case.numbers
        numbers = numbers._replace(lost=lost) if series.lost is Lost.COMMANDS else numbers._replace(missing=lost)
        outcome = crossing(case._replace(numbers=numbers), samples)
        cause = cause_of(outcome, len(plan.crossings)) or ""
        error = outcome.error_peak if cause in ("", FAR) else None
        rows.append(LossRow(number, series.equipment, series.lost.value, series.burst, start / RATE_HZ, error, cause))
    return rows


class Losses(NamedTuple):
    """The errors of an equipment.

    Attributes:
        equipment: its name.
        lost: what is lost.
        moments: [n], when a burst begins (s).
        errors: [len(BURSTS[lost]), n], largest distance from the reference (m), NaN where the run fails otherwise.
        without: the same without a loss (m).
    """

    equipment: str
    lost: Lost
    moments: FloatArray
    errors: FloatArray
    without: float

    @property
    def failures(self) -> tuple[int, ...]:
        """How many runs fail by a fault or end in the wrong assembly mode, for each burst."""
        return tuple(int(count) for count in np.isnan(self.errors).sum(axis=1))

    @property
    def worst(self) -> tuple[float | None, ...]:
        """The largest of all errors (m), for each burst; None where all runs fail otherwise."""
        return tuple(None if np.isnan(row).all() else float(np.nanmax(row)) for row in self.errors)

    @property
    def when(self) -> tuple[float | None, ...]:
        """The moment (s) of each of these."""
        worst = zip(self.worst, self.errors, strict=True)
        return tuple(None if error is None else float(self.moments[np.nanargmax(row)]) for error, row in worst)

    def as_json(self) -> dict[str, Any]:
        """Return the worst of all moments, and when it is, for each burst."""
        return {
            "equipment": self.equipment,
            "of": self.lost.value,
            "without_m": None if np.isnan(self.without) else self.without,
            "lost": BURSTS[self.lost],
            "worst_m": self.worst,
            "at_s": self.when,
            "failures": self.failures,
        }


def losses_of(rows: Sequence[LossRow]) -> list[Losses]:
    """Return the errors of each equipment, first those of lost commands."""
    found = []
    for lost, name in dict.fromkeys((row.lost, row.equipment) for row in rows):
        mine = [row for row in rows if (row.lost, row.equipment) == (lost, name)]
        errors = {
            burst: np.array([np.nan if row.error is None else row.error for row in mine if row.burst == burst])
            for burst in (0, *BURSTS[Lost(lost)])
        }
        none, *bursts = errors.values()
        moments = np.array([row.moment for row in mine if row.burst == BURSTS[Lost(lost)][0]])
        found.append(Losses(name, Lost(lost), moments, np.stack(bursts), float(none[0])))
    return found


def losses_table(losses: Sequence[Losses]) -> Table:
    """Return the worst error of each burst, an equipment and what it loses a row."""
    lengths = sorted({burst for bursts in BURSTS.values() for burst in bursts})
    lines = []
    for one in losses:
        worst = {0: one.without, **dict(zip(BURSTS[one.lost], one.worst, strict=True))}
        given = (worst.get(burst) for burst in (0, *lengths))
        lines.append((Cell(one.lost.value, one.lost.value), Cell(one.equipment, one.equipment), *map(_error, given)))
    columns = ("lost", "controller", "none", *(f"{length}" for length in lengths))
    words = (
        "By how many are lost in a row: largest error of all moments at which the burst begins. Empty: not tried, or"
        " every run fails otherwise."
    )
    return Table("losses", "Largest error", words, columns, tuple(lines))


def _error(error: float | None) -> Cell:
    return Cell("", None) if error is None or np.isnan(error) else Cell(in_millimetres(error), error)


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
    for one, colour in zip(losses, itertools.cycle(COLOURS), strict=False):
        axes.plot(one.moments, one.errors[row] * 1e3, color=colour, label=one.equipment, lw=1.2)
    burst, lost = BURSTS[losses[0].lost][row], losses[0].lost
    on_locus = prepared(losses[0].equipment, DURATION)[0].plan().crossings[0].time
    axes.axvline(on_locus, color=INK, linewidth=0.9, linestyle=":")
    axes.axhline(2.0, color=GREY, linewidth=0.9)
    axes.set_yscale("log")
    axes.set_title(f"{burst} {lost if burst > 1 else lost.removesuffix('s')}, {burst * 1e3 / RATE_HZ:g} ms")


def _explain(free: Axes, drawn: Axes) -> None:
    """Put into the free panel what the lines are, and why there is nothing to draw."""
    free.set_axis_off()
    free.legend(*drawn.get_legend_handles_labels(), loc="upper center", ncols=2)
    note = f"{LIMIT} samples and more: stopped with estimate_lost\ndotted: on the locus; grey: tolerance of 2 mm"
    free.text(0.5, 0.1, note, transform=free.transAxes, ha="center")


def losses_report(settings: LossSettings, rows: Sequence[LossRow]) -> StudyReport:
    """Return table, figure and page."""
    losses = losses_of(rows)
    with house_style():
        picture = Picture("losses", "Largest error over the moment of the loss.", png(losses_figure(losses)))
    table, command = losses_table(losses), command_of(settings)
    content = {"duration_s": DURATION, "rate_hz": RATE_HZ, "losses": [one.as_json() for one in losses]}
    page = study_page(
        title="What do lost commands and samples cost?",
        setting=f"middle crossing in {DURATION:g} s · {RATE_HZ} samples/s · simulated by the compiled engine",
        command=command,
        tables=[table],
        pictures=[picture],
    )
    return StudyReport(page, {"command": command, **content}, [picture], table)


def command_of(settings: LossSettings) -> str:
    """Return the command that repeats the study."""
    return " ".join(["fivebar robustness --losses", *settings.options("controllers")])


LOSSES = Study(
    name="losses",
    place=f"{__name__}:LOSSES",
    settings=LossSettings,
    table=RowTable(LossRow),
    run=run_numbered,
    cases=lambda settings: len(series_of(settings)),
    chunk=1,
    report=losses_report,
    program=lambda settings: program_digest(
        (*DECIDING, *(f"studies/robustness/{module}.py" for module in ("bursts", "running"))),
        (ROBOT,),
        RIGS,
        settings.controllers,
    ),
    command=command_of,
)
"""The study of bursts that are lost."""
