# SPDX-License-Identifier: Apache-2.0
"""Style of the figures: colours that colour-blind readers can tell apart, axes, zones, and rendering as PNG."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import Any

import matplotlib
import matplotlib.style
import numpy as np
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.ticker import FixedLocator, LogLocator, MaxNLocator, NullLocator, ScalarFormatter

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.recorded.series import RunSeries
from fivebar_bringup.simulation.column_metrics import peak

INK, GREY, PALE = "#1f2430", "#6b7280", "#d5d9e0"
BLUE, VERMILION, GREEN, PURPLE = "#0072b2", "#d55e00", "#009e73", "#9b4f96"
AMBER, SKY = "#b8860b", "#56b4e9"
ZONE = "#f6d776"
MOTORS = (BLUE, VERMILION)

DPI = 150
WIDTH = 10.0

LEGEND_ROW, LEGEND_MARGIN = 0.2, 0.15
"""Height of a row of a legend below the axes, and what is between both (inches)."""

LARGE_TORQUE = 100.0
"""From this torque (Nm) on, a linear axis would hide everything but the peak."""

OUTLIER = 1000.0
"""An error this many times the usual one would hide it on a linear axis."""

STYLE: dict[str, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 10.5,
    "axes.edgecolor": GREY,
    "axes.labelcolor": INK,
    "axes.titlecolor": INK,
    "axes.titlesize": 11,
    "axes.titlelocation": "left",
    "axes.grid": True,
    "axes.axisbelow": True,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.formatter.use_mathtext": True,
    "axes.formatter.limits": (-3, 4),
    "axes.xmargin": 0.01,
    "grid.color": "#e6e8ec",
    "grid.linewidth": 0.8,
    "lines.linewidth": 1.6,
    "lines.solid_joinstyle": "round",
    "legend.frameon": False,
    "legend.fontsize": 9.5,
    "text.color": INK,
    "xtick.color": GREY,
    "ytick.color": GREY,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "figure.facecolor": "white",
    "savefig.facecolor": "white",
}


def new_figure(title: str, subtitle: str, height: float, width: float = WIDTH) -> Figure:
    """Return an empty figure (inches) with a headline; its axes are laid out below the headline."""
    figure = Figure(figsize=(width, height), dpi=DPI, layout="constrained")
    headline = 0.62 / height
    engine = figure.get_layout_engine()
    if engine is not None:
        engine.set(rect=(0.012, 0.01, 0.976, 0.985 - headline), w_pad=0.08, h_pad=0.06)  # type: ignore[call-arg]
    figure.text(0.022, 1.0 - 0.16 / height, title, fontsize=14, fontweight="bold", va="top")
    figure.text(0.022, 1.0 - 0.43 / height, subtitle, fontsize=9.5, color=GREY, va="top")
    return figure


def legend_below(figure: Figure, keys: Sequence[Artist], columns: int) -> None:
    """Put a legend below the axes, which make room for it; Matplotlib 3.6 has no place outside of them."""
    room = (-(-len(keys) // columns) * LEGEND_ROW + LEGEND_MARGIN) / figure.get_figheight()
    engine = figure.get_layout_engine()
    if engine is not None:
        left, bottom, width, height = engine.get()["rect"]
        engine.set(rect=(left, bottom + room, width, height - room))  # type: ignore[call-arg]
    figure.legend(handles=list(keys), loc="lower center", ncols=columns)


class PlainTicks(ScalarFormatter):
    """Ticks of a linear axis as plain text; as formulas they would take a quarter of a figure's time."""

    def __call__(self, x: float, pos: int | None = None) -> str:
        """Return the text of a tick."""
        return str(super().__call__(x, pos)).removeprefix(r"$\mathdefault{").removesuffix("}$")


def png(figure: Figure) -> bytes:
    """Return the figure as a PNG."""
    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if type(axis.get_major_formatter()) is ScalarFormatter:
                axis.set_major_formatter(PlainTicks())
    buffer = io.BytesIO()
    # what saves a figure of any format draws it twice
    FigureCanvasAgg(figure).print_png(buffer, metadata={"Software": None})  # type: ignore[no-untyped-call]
    return buffer.getvalue()


def svg(figure: Figure) -> bytes:
    """Return the figure as an SVG, the same bytes whenever it is drawn."""
    buffer = io.BytesIO()
    with matplotlib.rc_context({"svg.hashsalt": "fivebar", "svg.fonttype": "none"}):
        figure.savefig(buffer, format="svg", metadata={"Date": None})
    return buffer.getvalue()


def house_style() -> Any:
    """Return a context in which figures are drawn in this style."""
    return matplotlib.style.context(["default", STYLE])


def shade_zones(axes: Axes, series: RunSeries, label: str | None) -> None:
    """Shade where sigma > 0; `label` is for the legend."""
    edges = np.flatnonzero(np.diff(np.concatenate([[False], series.in_zone, [False]]).astype(np.int8)))
    for start, end in edges.reshape(-1, 2).tolist():
        axes.axvspan(
            float(series.time[start]),
            float(series.time[end - 1]),
            facecolor=ZONE,
            edgecolor=ZONE,
            alpha=0.55,
            linewidth=1.0,
            zorder=0.5,
            label=label,
        )
        label = None


def time_axis(panels: Sequence[Axes], series: RunSeries, planned: float) -> None:
    """Give panels above each other one time axis (s) as long as the planned motion; mark where a run was cut short."""
    end = float(series.time[-1])
    cut_short = end < 0.99 * planned
    shown = min(planned, 1.6 * end) if cut_short and end > 0.0 else planned
    panels[-1].set_xlabel("time in s")
    for axes in panels:
        axes.set_xlim(-0.01 * shown, 1.01 * shown)
        if cut_short:
            axes.axvspan(end, 1.02 * shown, facecolor="none", edgecolor=PALE, hatch="///", linewidth=0.0, zorder=0.4)
    if cut_short:
        panels[-1].text(
            0.5 * (end + shown),
            0.5,
            f"nothing recorded,\nplanned until {planned:.3g} s",
            transform=panels[-1].get_xaxis_transform(),
            ha="center",
            va="center",
            color=GREY,
            fontsize=9.5,
            bbox={"facecolor": "white", "edgecolor": PALE, "boxstyle": "round,pad=0.4"},
        )


def torque_axis(axes: Axes, *torques: FloatArray) -> None:
    """Scale the vertical axis for torques (Nm): linear, or symmetric logarithmic where they are large."""
    largest = max((peak(torque) or 0.0 for torque in torques), default=0.0)
    if largest > LARGE_TORQUE:
        _symmetric_log(axes, largest, 1.0)
        return
    bound = 1.12 * largest or 1.0
    axes.set_ylim(-bound, bound)
    axes.yaxis.set_major_locator(MaxNLocator(7, symmetric=True))


def error_axis(axes: Axes, errors: FloatArray) -> None:
    """Scale the vertical axis for errors: symmetric logarithmic where a few of them would hide all others."""
    known = np.abs(errors[np.isfinite(errors)])
    if not known.size:
        return
    largest, usual = float(np.max(known)), float(np.percentile(known, 90))
    if largest > OUTLIER * usual > 0.0:
        _symmetric_log(axes, largest, 10.0 ** np.floor(np.log10(usual)))


def _symmetric_log(axes: Axes, largest: float, linear: float) -> None:
    """Scale the vertical axis linearly up to +-`linear`, a power of ten, and logarithmically from there on."""
    decades = int(np.ceil(np.log10(largest / linear)))
    step = 1 if decades <= 3 else 2
    marks = [linear * 10.0**decade for decade in range(step, decades + 1, step)]
    axes.set_yscale("symlog", linthresh=linear, linscale=0.8)
    axes.yaxis.set_major_locator(FixedLocator([*(-mark for mark in reversed(marks)), 0.0, *marks]))
    axes.yaxis.set_minor_locator(NullLocator())
    bound = linear * 10.0 ** (decades + 0.2)
    axes.set_ylim(-bound, bound)


def log_axis(axes: Axes, low: float, high: float) -> None:
    """Scale the vertical axis logarithmically over whole decades, with few ticks."""
    axes.set_yscale("log")
    bottom, top = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    # a single value may be a power of ten
    axes.set_ylim(10.0**bottom, 10.0 ** max(top, bottom + 1))
    axes.yaxis.set_major_locator(LogLocator(base=10.0, numticks=8))
    axes.yaxis.set_minor_locator(NullLocator())
