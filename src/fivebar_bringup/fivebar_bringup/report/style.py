"""How the figures look: colours that colour-blind readers can tell apart, axes, zones, and the way to a PNG."""

from __future__ import annotations

import io
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import LogLocator, MaxNLocator, NullLocator, SymmetricalLogLocator

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.report.series import RunSeries
from fivebar_bringup.report.summary import peak

INK, GREY, PALE = "#1f2430", "#6b7280", "#d5d9e0"
BLUE, VERMILION, GREEN, PURPLE = "#0072b2", "#d55e00", "#009e73", "#9b4f96"
ZONE = "#f6d776"
MOTORS = (BLUE, VERMILION)

DPI = 150
WIDTH = 10.0

LARGE_TORQUE = 100.0
"""From this torque (Nm) on, a linear axis would hide all that happens away from the peak."""

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


def png(figure: Figure) -> bytes:
    """Return the figure as a PNG."""
    buffer = io.BytesIO()
    figure.savefig(buffer, format="png", metadata={"Software": None})
    return buffer.getvalue()


def house_style() -> Any:
    """Return a context in which figures are made and drawn in this style."""
    return matplotlib.rc_context(STYLE)


def shade_zones(axes: Axes, series: RunSeries, label: str | None = "blending zone, σ > 0") -> None:
    """Shade where sigma > 0."""
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


def time_axis(axes: Axes, series: RunSeries, planned: float) -> None:
    """Label the time axis (s), as long as the planned motion, and mark where a run was cut short."""
    axes.set_xlim(-0.01 * planned, 1.01 * planned)
    axes.set_xlabel("time in s")
    end = float(series.time[-1])
    if end < 0.99 * planned:
        for each in axes.figure.axes:
            each.axvspan(end, 1.02 * planned, facecolor="none", edgecolor=PALE, hatch="///", linewidth=0.0, zorder=0.4)
        axes.text(
            0.5 * (end + planned),
            0.5,
            "run ended" if planned - end < 0.3 * planned else "nothing recorded from here on",
            transform=axes.get_xaxis_transform(),
            ha="center",
            va="center",
            color=GREY,
            bbox={"facecolor": "white", "edgecolor": PALE, "boxstyle": "round,pad=0.4"},
        )


def torque_axis(axes: Axes, *torques: FloatArray) -> None:
    """Scale the vertical axis for torques (Nm): linear, or symmetric logarithmic where they are large."""
    largest = max((peak(torque) or 0.0 for torque in torques), default=0.0)
    if largest <= LARGE_TORQUE:
        bound = 1.12 * largest or 1.0
        axes.set_ylim(-bound, bound)
        axes.yaxis.set_major_locator(MaxNLocator(7, symmetric=True))
        return
    decades = int(np.ceil(np.log10(largest)))
    axes.set_yscale("symlog", linthresh=1.0, linscale=0.8)
    axes.yaxis.set_major_locator(
        SymmetricalLogLocator(linthresh=1.0, base=10.0 if decades <= 4 else 100.0)  # type: ignore[no-untyped-call]
    )
    axes.yaxis.set_minor_locator(NullLocator())
    axes.set_ylim(-(10.0 ** (decades + 0.2)), 10.0 ** (decades + 0.2))


def log_axis(axes: Axes, low: float, high: float) -> None:
    """Scale the vertical axis logarithmically over whole decades, with few ticks."""
    axes.set_yscale("log")
    bottom, top = int(np.floor(np.log10(low))), int(np.ceil(np.log10(high)))
    axes.set_ylim(10.0**bottom, 10.0**top)
    axes.yaxis.set_major_locator(LogLocator(base=10.0, numticks=8))
    axes.yaxis.set_minor_locator(NullLocator())


def engineering(value: float | None, unit: str) -> str:
    """Return a figure for a person: three significant digits with a prefix that suits, or a dash."""
    if value is None:
        return "–"
    if value == 0.0:
        return f"0 {unit}"
    for factor, prefix in ((1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ")):
        if abs(value) >= 0.9995 * factor:
            return f"{_three_digits(value / factor)} {prefix}{unit}"
    return f"{_three_digits(value / 1e-9)} n{unit}"


def _three_digits(value: float) -> str:
    decimals = 2 if abs(value) < 9.995 else 1 if abs(value) < 99.95 else 0
    return f"{value:.{decimals}f}"
