# SPDX-License-Identifier: Apache-2.0
"""The figures of a sweep: distributions of the errors, maps of the failures, what the error depends on."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import NullLocator

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.odds.odds import FINAL_LIMIT, PEAK_LIMIT
from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.style import GREEN, GREY, INK, VERMILION, house_style, log_axis, new_figure, png
from fivebar_bringup.report.workspace import draw_map, survey
from fivebar_control.planning.postures import WORKING_MODES
from fivebar_description.robot_file import load_robot
from fivebar_studies.compare.figures import look_of
from fivebar_studies.sweep.rows import FEASIBLE, SCREENED_OUT, SweepRow, controllers_of
from fivebar_studies.sweep.statistics import runs_of

LOWEST = -0.185
"""Lower edge of the maps (m)."""

MODE_NAMES = {(1, -1): "elbows outwards", (-1, 1): "elbows inwards", (1, 1): "both left", (-1, -1): "both right"}

LEAST_ERROR = 1e-5
"""Errors (m) below this are drawn there."""


def sweep_figures(rows: Sequence[SweepRow]) -> list[Picture]:
    """Return the figures; there are none without a run."""
    if not controllers_of(rows):
        return []
    with house_style():
        return [_distributions(rows), _factors(rows), _maps(rows)]


def _distributions(rows: Sequence[SweepRow]) -> Picture:
    size = rows[0].draw.size
    figure = new_figure(
        "How large the errors are", "share of the crossings with a larger error; both axes are logarithmic", 5.2
    )
    panels = figure.subplots(1, 2, sharey=True)
    kinds: tuple[tuple[str, Callable[[SweepRow], float | None], float], ...] = (
        ("peak error in mm", lambda row: row.error_peak, size * PEAK_LIMIT),
        ("final error in mm", lambda row: row.error_final, size * FINAL_LIMIT),
    )
    most = 1
    for axes, (title, error, limit) in zip(panels, kinds, strict=True):
        for controller in controllers_of(rows):
            colour = look_of(controller)[0]
            for statuses, line in (((FEASIBLE,), "-"), ((FEASIBLE, SCREENED_OUT), ":")):
                runs = runs_of(rows, controller, *statuses)
                known = np.sort([max(value, LEAST_ERROR) for row in runs if (value := error(row)) is not None])
                if not known.size:
                    continue
                most = max(most, known.size)
                beyond = 1.0 - np.arange(known.size) / known.size
                label = controller if line == "-" else None
                axes.step(1e3 * known, beyond, line, color=colour, where="post", label=label)
        axes.axvline(1e3 * limit, color=INK, linewidth=1.0, linestyle="--", zorder=1.5)
        axes.set_xscale("log")
        axes.set_xlabel(title)
    log_axis(panels[0], 1.0 / most, 1.0)
    panels[0].set_ylabel("share with a larger error")
    panels[0].legend(loc="lower left")
    caption = (
        "Solid: crossings that the controller's screen judged feasible. Dotted: all that the planner accepted."
        " Dashed: limit of a success."
    )
    return Picture("errors", caption, png(figure))


def _factors(rows: Sequence[SweepRow]) -> Picture:
    controllers = controllers_of(rows)
    figure = new_figure(
        "What the peak error depends on",
        "crossings judged feasible; crosses: not a success",
        2.0 + 1.9 * len(controllers),
    )
    panels = figure.subplots(len(controllers), 3, sharex="col", sharey=True, squeeze=False)
    kinds: tuple[tuple[str, Callable[[SweepRow], float | None]], ...] = (
        ("duration in s", lambda row: row.duration),
        ("|n.v1| where it crosses", lambda row: row.authority),
        ("1/cond(A) at rest", lambda row: row.rest_kappa),
    )
    for line, controller in zip(panels, controllers, strict=True):
        runs = runs_of(rows, controller, FEASIBLE)
        line[0].set_ylabel(f"{controller}\nerror in mm")
        for axes, (_, factor) in zip(line, kinds, strict=True):
            _cloud(axes, [row for row in runs if row.success], factor, look_of(controller)[0], "o", 3.0)
            _cloud(axes, [row for row in runs if not row.success], factor, INK, "x", 16.0)
            axes.axhline(1e3 * rows[0].draw.size * PEAK_LIMIT, color=INK, linewidth=1.0, linestyle="--")
    known = [max(row.error_peak, LEAST_ERROR) for row in rows if row.status == FEASIBLE and row.error_peak is not None]
    if known:
        log_axis(panels[0, 0], 1e3 * min(known), 1e3 * max(known))
    for axes, (title, _) in zip(panels[-1], kinds, strict=True):
        axes.set_xlabel(title)
        axes.set_xscale("log")
    panels[-1, 0].set_xticks([0.3, 0.5, 1.0, 2.0, 3.0], ["0.3", "0.5", "1", "2", "3"])
    panels[-1, 1].set_xticks([0.3, 0.5, 0.7, 1.0], ["0.3", "0.5", "0.7", "1"])
    panels[-1, 2].set_xticks([0.05, 0.1, 0.2, 0.5, 1.0], ["0.05", "0.1", "0.2", "0.5", "1"])
    for axes in panels[-1]:
        axes.xaxis.set_minor_locator(NullLocator())
    return Picture(
        "factors",
        "Peak error over the duration, over how well the path's normal can be controlled on the locus, and over how"
        " far from the locus the platform rests. Dashed: limit of a success.",
        png(figure),
    )


def _cloud(
    axes: Axes,
    rows: Sequence[SweepRow],
    factor: Callable[[SweepRow], float | None],
    colour: str,
    marker: str,
    size: float,
) -> None:
    points = _points(rows, lambda row: (factor(row), None if row.error_peak is None else 1e3 * row.error_peak))
    points[:, 1] = np.maximum(points[:, 1], 1e3 * LEAST_ERROR)
    axes.scatter(points[:, 0], points[:, 1], s=size, color=colour, marker=marker, linewidths=1.0 if size > 9.0 else 0.0)


def _points(rows: Sequence[SweepRow], place: Callable[[SweepRow], tuple[float | None, float | None]]) -> FloatArray:
    """Return float64[n, 2] of the rows that have both values."""
    places = [place(row) for row in rows]
    return np.array([place for place in places if None not in place], dtype=np.float64).reshape(-1, 2)


def _maps(rows: Sequence[SweepRow]) -> Picture:
    controllers = controllers_of(rows)
    robot = load_robot(rows[0].draw.robot_name)
    figure = new_figure(
        "Where crossings fail", "working modes from top to bottom, in mm", 1.2 + 2.3 * len(WORKING_MODES)
    )
    panels = figure.subplots(len(WORKING_MODES), len(controllers), sharex=True, sharey=True, squeeze=False)
    for line, modes in enumerate(WORKING_MODES):
        plane = survey(robot, modes, rows[0].draw.size * LOWEST)
        for column, controller in enumerate(controllers):
            axes = panels[line, column]
            draw_map(axes, plane)
            runs = [row for row in runs_of(rows, controller, FEASIBLE, SCREENED_OUT) if (row.mode1, row.mode2) == modes]
            for status, success, colour, size in (
                (SCREENED_OUT, False, GREY, 3.0),
                (FEASIBLE, True, GREEN, 3.0),
                (FEASIBLE, False, VERMILION, 26.0),
            ):
                kind = [row for row in runs if (row.status, row.success) == (status, success)]
                points = 1e3 * _points(kind, lambda row: (row.crossing_x, row.crossing_y))
                marker = "X" if size > 9.0 else "o"
                axes.scatter(points[:, 0], points[:, 1], s=size, color=colour, marker=marker, linewidths=0.0, zorder=3)
                if (status, success) == (FEASIBLE, False):
                    for row in kind:
                        way = 1e3 * np.array(row.draw.legs()[0]).T
                        axes.plot(*way, color=VERMILION, linewidth=0.7, alpha=0.7, zorder=2.5)
            axes.set_aspect("equal")
            axes.grid(False)
            if line == 0:
                axes.set_title(controller)
            if column == 0:
                axes.set_ylabel(MODE_NAMES[modes])
    return Picture(
        "maps",
        "Dots: where the path crosses the Type 2 locus. Green: judged feasible and successful. Orange, with the whole"
        " path: judged feasible and failed. Grey: screened out, run nevertheless, and failed; screened out and"
        " successful is not shown. Purple: the Type 2 locus.",
        png(figure),
    )
