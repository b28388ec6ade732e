# SPDX-License-Identifier: Apache-2.0
"""The dynamic criterion along a run (1.19, 2.4, 4.21): what the reference demands along t_s.

On the locus the free dynamics are m t_s^T xddot = 0, so a reference that demands more cannot be followed at that
instant. Away from the locus the motors can accelerate the platform in every direction, and the value has no meaning.
"""

from __future__ import annotations

import numpy as np
from matplotlib.figure import Figure

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.pages.style import GREY, INK, PURPLE, VERMILION, error_axis, new_figure, shade_zones, time_axis
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.units import engineering
from fivebar_control.model.state import Platform
from fivebar_control.trajectory.criterion import criterion_residual


def reference_residual(run: RunAnalysis) -> FloatArray:
    """Return [n], m t_s^T xddot (N) of the recorded reference; NaN where there is none.

    The sign follows t_s, which is continuous but for 1/cond(A) = 1, where the two singular directions change places.
    """
    rows = [
        criterion_residual(run.robot, run.plan.mode_at(t), Platform(*row))
        for t, row in zip(run.series.time.tolist(), run.series.reference.tolist(), strict=True)
    ]
    return np.array(rows, dtype=np.float64)


def crossing_residuals(run: RunAnalysis) -> list[float]:
    """Return the reference's m t_s^T xddot (N) at each planned crossing, in order of time."""
    plan = run.plan
    return [
        criterion_residual(run.robot, plan.mode_at(crossing.time), plan.path.at(crossing.time))
        for crossing in plan.crossings
    ]


def criterion(run: RunAnalysis) -> Figure:
    """Draw the residual over time, strong in the blending zones, with the planned crossings."""
    series, at_crossings = run.series, crossing_residuals(run)
    largest = max((abs(residual) for residual in at_crossings), default=None)
    figure = new_figure(
        "Dynamic criterion",
        "corresponds to equations 1.19, 2.4 and 4.21: on the locus the free dynamics give zero for any motor torque",
        4.4,
    )
    axes = figure.subplots()
    residual = reference_residual(run)
    # where the two directions change places the line would jump
    leaps = np.flatnonzero(np.abs(np.diff(residual)) > 0.2 * np.nanmax(np.abs(residual), initial=1e-30))
    whole = residual.copy()
    whole[leaps] = np.nan
    axes.plot(series.time, whole, color=PURPLE, linewidth=1.2, alpha=0.45)
    axes.plot(series.time, np.where(series.in_zone, whole, np.nan), color=PURPLE, linewidth=2.4, label="reference")
    axes.axhline(0.0, color=GREY, linewidth=0.9)
    for number, (crossing, value) in enumerate(zip(run.plan.crossings, at_crossings, strict=True)):
        axes.axvline(crossing.time, color=INK, linewidth=0.9, linestyle=":", zorder=1.0)
        axes.plot(
            crossing.time,
            value,
            linestyle="none",
            marker="o",
            markersize=6.5,
            color=VERMILION,
            mec="white",
            zorder=5.0,
            label="on the locus" if number == 0 else None,
        )
    axes.set_title(
        "m tₛᵀẍ of the reference" + (f": up to {engineering(largest, 'N')} on the locus" if at_crossings else "")
    )
    axes.set_ylabel("force along tₛ in N")
    error_axis(axes, np.concatenate([whole, at_crossings]))
    time_axis([axes], series, run.plan.path.duration)
    shade_zones(axes, series, run.zone_name)
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=3, borderpad=0.0)
    return figure
