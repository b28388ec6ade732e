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
        if result.calibration.turning is not None:
            pictures.append(Picture("closure", CLOSURE, png(residuals(result))))
        return [*pictures, Picture("parameters", PARAMETERS, png(parameters(result)))]


def gap(result: CalibrationResult) -> Figure:
    """Draw the elbow gap before and what is left of it."""
    calibration = result.calibration
    before, after = 1e3 * calibration.gaps_before(), 1e6 * calibration.gap_half_widths()
    figure = new_figure("Elbow gap", f"at {len(before)} crossings, {INTERVALS}", 3.6)
    before_axes, after_axes = figure.subplots(1, 2)
    numbers = np.arange(1, len(before) + 1)
    before_axes.bar(numbers, before, color=GREY)
    before_axes.set_title("before")
    before_axes.set_ylabel("elbow gap in mm")
    after_axes.errorbar(numbers, 0.0 * after, yerr=after, color=BLUE, marker="o", capsize=5.0, linestyle="none")
    after_axes.set_title("after")
    after_axes.set_ylabel("elbow gap in µm")
    after_axes.margins(x=0.1)
    for axes in (before_axes, after_axes):
        axes.axhline(0.0, color=GREY, linewidth=0.7)
        axes.set_xlabel("crossing")
    return figure


def residuals(result: CalibrationResult) -> Figure:
    """Draw the closure's residuals over time."""
    calibration = result.calibration
    figure = new_figure(
        "Closure", f"root mean square {1e6 * float(np.sqrt(np.mean(calibration.residuals**2))):.1f} µm", 3.6
    )
    axes = figure.subplots()
    near = np.abs(calibration.across) < 0.1
    axes.fill_between(
        calibration.times, 0.0, 1.0, where=near.tolist(), color=GREY, alpha=0.3, transform=axes.get_xaxis_transform()
    )
    axes.plot(calibration.times, 1e6 * calibration.residuals, color=BLUE, linewidth=0.8)
    axes.set_xlabel("time in s")
    axes.set_ylabel("residual in µm")
    return figure


def parameters(result: CalibrationResult) -> Figure:
    """Draw the changes of the geometry with their intervals."""
    shown = result.parameters()[:8]
    figure = new_figure("Geometry", f"changes from {result.start.name}, {INTERVALS}", 4.2)
    for axes, rows in zip(figure.subplots(1, 2, width_ratios=[1.6, 1.0]), (shown[:6], shown[6:]), strict=True):
        for number, parameter in enumerate(rows):
            _draw_row(axes, number, parameter)
        axes.axvline(0.0, color=GREY, linewidth=1.0)
        axes.set_yticks(range(len(rows)), [row.name for row in rows])
        axes.set_ylim(len(rows) - 0.5, -0.5)
        axes.set_xlabel(f"change in {rows[0].unit}")
    return figure


def _draw_row(axes: Axes, number: int, parameter: CalibratedParameter) -> None:
    axes.errorbar(0.0, number - 0.12, xerr=parameter.half_width_before, color=GREY, capsize=3.0, linestyle="none")
    change = parameter.value - parameter.before
    axes.errorbar(
        change, number + 0.12, xerr=parameter.half_width, color=BLUE, marker="o", capsize=4.0, linestyle="none"
    )
