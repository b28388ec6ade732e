# SPDX-License-Identifier: Apache-2.0
"""The figures of a run over time: torques, constraint error, supervisor, tracking, acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.pages.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    MOTORS,
    PURPLE,
    VERMILION,
    error_axis,
    log_axis,
    new_figure,
    shade_zones,
    time_axis,
    torque_axis,
)
from fivebar_bringup.recorded.series import RunSeries
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.thesis import counterpart
from fivebar_bringup.simulation.column_metrics import peak
from fivebar_bringup.units import error_of, plain, suitable_unit

if TYPE_CHECKING:
    # from matplotlib 3.8 on
    from matplotlib.typing import LineStyleType


def torques(run: RunAnalysis) -> Figure:
    """Draw both motors' torques, and the requested ones where the drives gave less."""
    figure = new_figure("Motor torques", f"corresponds to {counterpart(run.scenario).torque}", 6.0)
    series, summary = run.series, run.summary
    panels = figure.subplots(2, 1, sharex=True)
    for motor, axes in enumerate(panels):
        applied, requested = series.torque_applied[:, motor], series.torque_requested[:, motor]
        title = f"motor {motor + 1}: {plain(summary.torque_peak_nm[motor], 'Nm')} applied"
        if run.torque_was_limited:
            axes.plot(series.time, requested, color=GREY, linewidth=1.0, label="requested")
            title += f", {plain(summary.torque_requested_peak_nm[motor], 'Nm')} requested"
        axes.plot(series.time, applied, color=MOTORS[motor], linewidth=1.9, label="applied")
        torque_axis(axes, series.torque_applied, *([series.torque_requested] if run.torque_was_limited else []))
        axes.set_title(title)
        axes.set_ylabel("torque in Nm")
        axes.axhline(0.0, color=GREY, linewidth=0.7, zorder=1.0)
    finish(run, panels)
    return figure


def vhc_error(run: RunAnalysis) -> Figure:
    """Draw the error of the virtual constraint in both its forms, strong where the constraint law acts."""
    other = counterpart(run.scenario)
    figure = new_figure(
        "Error of the virtual constraint", f"corresponds to {other.vhc_error}; joint form: {other.vhc_error_joint}", 6.0
    )
    series, summary = run.series, run.summary
    panels = figure.subplots(2, 1, sharex=True)
    lengths, unit = suitable_unit(peak(series.vhc_error), "m")
    _zoned_line(panels[0], series, series.vhc_error * lengths, GREEN, "h")
    panels[0].set_title(f"distance h from the path: up to {error_of(summary.vhc_error_max_m, 'm')} in the zones")
    panels[0].set_ylabel(f"h in {unit}")
    angles, unit = suitable_unit(peak(series.vhc_error_joint), "rad")
    for motor in range(2):
        name = f"motor {motor + 1}"
        style: LineStyleType = "-" if motor == 0 else (0.0, (2.0, 1.2))
        _zoned_line(panels[1], series, series.vhc_error_joint[:, motor] * angles, MOTORS[motor], name, style)
    panels[1].set_title(
        f"motor angles: up to {error_of(summary.vhc_error_joint_max_rad, 'rad')} from those of the nearest path point"
    )
    panels[1].set_ylabel(f"error in {unit}")
    error_axis(panels[0], series.vhc_error * lengths)
    error_axis(panels[1], series.vhc_error_joint * angles)
    finish(run, panels)
    return figure


def supervisor(run: RunAnalysis) -> Figure:
    """Draw the weight, the conditioning it follows from, and the candidate torques."""
    series = run.series
    use = "corresponds to section 4.1.2"
    if not run.blends:
        use = "this controller does not use σ"
    elif not run.blends_by_condition:
        use = "σ is a function of time with this controller"
    figure = new_figure("Supervisor and candidate torques", use, 7.6)
    panels = figure.subplots(3, 1, sharex=True, height_ratios=[1.0, 1.2, 1.7])
    panels[0].plot(series.time, series.sigma, color=PURPLE)
    panels[0].set_ylim(-0.06, 1.12)
    panels[0].set_ylabel("σ")
    panels[0].set_title("weight of the constraint law")
    panels[1].plot(series.time, series.kappa, color=BLUE, label="1/cond(A)")
    widths = np.array([run.plan.epsilon_at(t) for t in series.time.tolist()])
    if run.blends_by_condition and np.any(widths > 0.0):
        panels[1].plot(series.time, 2.0 * widths, color=INK, linestyle="--", linewidth=1.1, label="2ε: blending begins")
        panels[1].plot(series.time, widths, color=INK, linestyle=":", linewidth=1.3, label="ε: constraint law alone")
    panels[1].set_ylim(0.0, 1.05 * (peak(series.kappa) or 1.0))
    panels[1].set_ylabel("1/cond(A)")
    panels[1].set_title("distance from the Type 2 locus")
    _candidates(panels[2], run)
    finish(run, panels)
    return figure


def tracking(run: RunAnalysis) -> Figure:
    """Draw the platform's distance from the reference along both axes."""
    series, summary = run.series, run.summary
    largest = error_of(summary.tracking_error_peak_m, "m")
    figure = new_figure("Tracking error of the platform", f"largest distance from the reference {largest}", 4.4)
    axes = figure.subplots()
    scale, unit = suitable_unit(summary.tracking_error_peak_m, "m")
    for column, (name, color) in enumerate((("x", BLUE), ("y", VERMILION))):
        rms = error_of(summary.tracking_error_rms_m[column], "m")
        axes.plot(
            series.time, series.tracking_error[:, column] * scale, color=color, label=f"{name}, root mean square {rms}"
        )
    axes.set_ylabel(f"platform − reference in {unit}")
    error_axis(axes, series.tracking_error * scale)
    finish(run, [axes])
    return figure


def acceleration(run: RunAnalysis) -> Figure:
    """Draw the error of the acceleration's magnitude measured by the IMU."""
    series, summary = run.series, run.summary
    other = counterpart(run.scenario)
    figure = new_figure("Acceleration check by the IMU", f"corresponds to {other.acceleration}", 4.4)
    axes = figure.subplots()
    axes.plot(series.time, series.acceleration_error, color=BLUE, linewidth=1.2)
    axes.set_title(
        "measured minus desired magnitude: root mean square"
        f" {plain(summary.imu_acceleration_error_rms, 'm/s²')},"
        f" at most {plain(peak(series.acceleration_error), 'm/s²')}"
    )
    axes.set_ylabel("error in m/s²")
    error_axis(axes, series.acceleration_error)
    finish(run, [axes])
    return figure


def _candidates(axes: Axes, run: RunAnalysis) -> None:
    """Draw the larger motor's torque of every law on a logarithmic axis."""
    series = run.series
    controller = run.scenario.scheme()
    lines = [(controller.nominal.title, _larger(series.torque_nominal), GREY, 1.2)]
    if controller.constraint is not None:
        constraint = np.where(series.in_zone, _larger(series.torque_vhc), np.nan)
        lines.append((controller.constraint.title, constraint, PURPLE, 2.4))
    lines.append(("applied", _larger(series.torque_applied), BLUE, 1.6))
    for name, values, color, width in lines:
        axes.plot(series.time, np.where(values > 0.0, values, np.nan), color=color, linewidth=width, label=name)
    largest = max((peak(values) or 0.0 for _, values, _, _ in lines), default=0.0)
    log_axis(axes, 0.01, max(10.0, largest))
    axes.set_ylabel("larger of both torques in Nm")
    axes.set_title(f"{controller.nominal.title} requests up to {plain(peak(series.torque_nominal), 'Nm')}")


def _larger(torque: FloatArray) -> FloatArray:
    """Return [n], the larger magnitude of a pair [n, 2]; NaN where one is undefined."""
    larger: FloatArray = np.max(np.abs(torque), axis=1)
    return larger


def _zoned_line(
    axes: Axes, series: RunSeries, values: FloatArray, color: str, name: str, style: LineStyleType = "-"
) -> None:
    """Draw a series, pale outside the blending zones."""
    inside = np.where(series.in_zone, values, np.nan)
    axes.plot(series.time, values, color=color, linewidth=1.2, alpha=0.45, linestyle=style)
    axes.plot(series.time, inside, color=color, linewidth=2.4, label=name, linestyle=style)


def finish(run: RunAnalysis, panels: Sequence[Axes]) -> None:
    """Share the time axis and put one legend above the first panel."""
    time_axis(panels, run.series, run.plan.path.duration)
    for number, axes in enumerate(panels):
        shade_zones(axes, run.series, run.zone_name if number == 0 else None)
        handles, names = axes.get_legend_handles_labels()
        if names:
            axes.legend(handles, names, loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=len(names), borderpad=0.0)
