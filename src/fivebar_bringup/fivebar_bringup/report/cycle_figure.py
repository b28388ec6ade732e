# SPDX-License-Identifier: Apache-2.0
"""How evenly a run in real time kept its time: the times from one recorded sample to the next."""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from fivebar_bringup.pages.style import BLUE, INK, new_figure
from fivebar_bringup.recorded.summary import sample_periods
from fivebar_bringup.report.analysis import RunAnalysis

BINS_PER_PERIOD = 20
LONGEST = 5.0
"""Bins of the histogram within a period of the clock, and periods beyond which times share the last bin."""


def cycles(run: RunAnalysis) -> Figure:
    """Draw the histogram of the cycle times, with the period of the clock."""
    summary = run.summary
    period = 1e3 / run.scenario.rate_hz
    times = np.minimum(sample_periods(run.series), LONGEST * period)
    edges = np.linspace(0.0, LONGEST * period, round(LONGEST * BINS_PER_PERIOD) + 1)
    subtitle = "times from one recorded sample to the next; the last bar holds all longer ones"
    figure = new_figure("Cycle times", subtitle, 4.4)
    axes = figure.subplots()
    axes.hist(times, edges.tolist(), color=BLUE)
    axes.axvline(period, color=INK, linewidth=0.9, linestyle=":", label="period of the clock")
    axes.set_xlim(0.0, LONGEST * period)
    axes.set_yscale("log")
    axes.set_ylim(bottom=0.5)
    axes.set_xlabel("ms")
    axes.set_ylabel("samples")
    late = summary.overruns or 0
    axes.set_title(f"of {summary.planned_samples} samples {late} were answered late, {summary.missing_samples} missing")
    axes.legend()
    return figure
