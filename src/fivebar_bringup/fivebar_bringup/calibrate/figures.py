# SPDX-License-Identifier: Apache-2.0
"""The figures of a calibration: the elbow gap at the crossings, the closure's residuals, the parameters."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fivebar_bringup.calibrate.result import INTERVALS, CalibratedParameter, CalibrationResult
from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.style import BLUE, GREY, house_style, new_figure, png

GAP = (
    "The elbow gap at every passage through the Type 2 locus: how much further apart the elbows are, by the robot's"
    " file before, than the distal links are long (grey), and the interval that the calibration leaves (blue)."
)
CLOSURE = (
    "By how much the loop does not close at the readings of motors and gyroscope, with the calibrated geometry. Shaded:"
    " near the locus."
)
PARAMETERS = (
    "Change of every parameter of the geometry, with its interval after the calibration (blue) and before it (grey)."
)


def draw_pictures(result: CalibrationResult) -> list[Picture]:
    """Return the pictures in the order in which the page shows them."""
    with house_style():
        pictures = [Picture("gap", GAP, png(gap(result)))]
        if result.found.turning is not None:
            pictures.append(Picture("closure", CLOSURE, png(residuals(result))))
        return [*pictures, Picture("parameters", PARAMETERS, png(parameters(result)))]


def gap(result: CalibrationResult) -> Figure:
    """Draw the elbow gap before and what is left of it."""
    found = result.found
    before, after = 1e3 * found.gaps_before(), 1e6 * found.gap_half_widths()
    figure = new_figure("Elbow gap", f"at {len(before)} crossings, {INTERVALS}", 3.6)
    one, two = figure.subplots(1, 2)
    numbers = np.arange(1, len(before) + 1)
    one.bar(numbers, before, color=GREY)
    one.set_title("before")
    one.set_ylabel("elbow gap in mm")
    two.errorbar(numbers, 0.0 * after, yerr=after, color=BLUE, marker="o", capsize=5.0, linestyle="none")
    two.set_title("after")
    two.set_ylabel("elbow gap in µm")
    two.margins(x=0.1)
    for axes in (one, two):
        axes.axhline(0.0, color=GREY, linewidth=0.7)
        axes.set_xlabel("crossing")
    return figure


def residuals(result: CalibrationResult) -> Figure:
    """Draw the closure's residuals over time."""
    found = result.found
    figure = new_figure("Closure", f"root mean square {1e6 * float(np.sqrt(np.mean(found.residuals**2))):.1f} µm", 3.6)
    axes = figure.subplots()
    near = np.abs(found.across) < 0.1
    axes.fill_between(
        found.times, 0.0, 1.0, where=near.tolist(), color=GREY, alpha=0.3, transform=axes.get_xaxis_transform()
    )
    axes.plot(found.times, 1e6 * found.residuals, color=BLUE, linewidth=0.8)
    axes.set_xlabel("time in s")
    axes.set_ylabel("residual in µm")
    return figure


def parameters(result: CalibrationResult) -> Figure:
    """Draw the changes of the geometry with their intervals."""
    shown = result.parameters()[:8]
    figure = new_figure("Geometry", f"changes from {result.start.name}, {INTERVALS}", 4.2)
    for axes, rows in zip(figure.subplots(1, 2, width_ratios=[1.6, 1.0]), (shown[:6], shown[6:]), strict=True):
        for number, one in enumerate(rows):
            _draw_row(axes, number, one)
        axes.axvline(0.0, color=GREY, linewidth=1.0)
        axes.set_yticks(range(len(rows)), [row.name for row in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlabel(f"change in {rows[0].unit}")
    return figure


def _draw_row(axes: Axes, number: int, one: CalibratedParameter) -> None:
    axes.errorbar(0.0, number - 0.12, xerr=one.half_width_before, color=GREY, capsize=3.0, linestyle="none")
    change = one.value - one.before
    axes.errorbar(change, number + 0.12, xerr=one.half_width, color=BLUE, marker="o", capsize=4.0, linestyle="none")
