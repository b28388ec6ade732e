# SPDX-License-Identifier: Apache-2.0
"""The run in the robot's plane: path, locus, workspace, postures; and the picture for the front page."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke

from fivebar_bringup.bag.recording import IntArray
from fivebar_bringup.pages.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    MOTORS,
    PURPLE,
    VERMILION,
    new_figure,
    shade_zones,
    time_axis,
    torque_axis,
)
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.outcome_words import mode_changes
from fivebar_bringup.report.scene import corners_of, lowest, waypoint_name
from fivebar_bringup.report.thesis import counterpart
from fivebar_bringup.report.workspace import NEGATIVE, POSITIVE, Map, draw_base, draw_map, draw_robot, frame, survey
from fivebar_bringup.simulation.column_metrics import peak
from fivebar_bringup.units import plain
from fivebar_control.trajectory.path import AnySegment

FAR = "#8a93a5"

GHOSTS = 6
"""Postures of the robot in the front page's picture."""

HERO_WIDTH, HERO_HEIGHT = 14.0, 5.6

Posture = tuple[int, str, str]


def survey_run(run: RunAnalysis) -> Map:
    """Return the map that both pictures of a run draw."""
    return survey(run.robot, run.modes, lowest(run.scenario.waypoints))


def path(run: RunAnalysis, plane: Map) -> Figure:
    """Draw reference and actual path, the locus, the boundary, and the robot in three postures."""
    figure = new_figure("Path and singularities", f"corresponds to {counterpart(run.scenario).path}", 6.0)
    axes = figure.subplots()
    draw_map(axes, plane)
    for row, color, _ in reversed(_postures(run)):
        _draw_posture(axes, run, row, color, 0.9, 3.0)
    _draw_path(axes, run, 6.5)
    draw_base(axes, run.robot)
    _name_waypoints(axes, run)
    frame(axes, run.robot, lowest(run.scenario.waypoints))
    axes.legend(handles=_legend(run), loc="center left", bbox_to_anchor=(1.01, 0.5), labelspacing=0.9)
    return figure


def hero(run: RunAnalysis, plane: Map) -> Figure:
    """Draw the robot on its way through the locus beside torques and weight over time."""
    figure, robot, _ = _beside_time(run)
    _draw_crossing(robot, run, plane)
    return figure


def moving(run: RunAnalysis, plane: Map) -> tuple[Figure, Axes, tuple[Axes, ...]]:
    """Draw the same without a robot; return the axes that wait for it, and those over time."""
    figure, robot, over_time = _beside_time(run)
    draw_map(robot, plane)
    _draw_reference(robot, run, 2.0)
    draw_base(robot, run.robot)
    frame(robot, run.robot, lowest(run.scenario.waypoints))
    robot.grid(visible=False)
    return figure, robot, over_time


def _beside_time(run: RunAnalysis) -> tuple[Figure, Axes, tuple[Axes, ...]]:
    """Draw torques and weight over time; return their axes after the empty ones beside them."""
    figure = new_figure(*_headline(run), HERO_HEIGHT, HERO_WIDTH)
    grid = figure.add_gridspec(2, 2, width_ratios=[1.0, 1.12], height_ratios=[2.4, 1.0])
    robot = figure.add_subplot(grid[:, 0])
    torque = figure.add_subplot(grid[0, 1])
    weight = figure.add_subplot(grid[1, 1], sharex=torque)
    series = run.series
    for motor in range(2):
        torque.plot(series.time, series.torque_applied[:, motor], color=MOTORS[motor], label=f"motor {motor + 1}")
    torque_axis(torque, series.torque_applied)
    torque.set_ylabel("applied torque in Nm")
    torque.tick_params(labelbottom=False)
    weight.plot(series.time, series.sigma, color=PURPLE, linewidth=2.0)
    weight.set_ylim(-0.06, 1.12)
    weight.set_ylabel("weight σ")
    time_axis((torque, weight), series, run.plan.path.duration)
    shade_zones(torque, series, run.zone_name)
    shade_zones(weight, series, None)
    torque.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=3, borderpad=0.0)
    return figure, robot, (torque, weight)


def _headline(run: RunAnalysis) -> tuple[str, str]:
    """Return title and subtitle of the front page's picture."""
    summary = run.summary
    working = summary.working_mode_changes if run.plan.working_mode_changes else None
    subtitle = mode_changes(summary.assembly_mode_changes, working)
    subtitle += f" with at most {plain(peak(run.series.torque_applied), 'Nm')}"
    if run.torque_was_limited:
        subtitle += f", where {plain(peak(run.series.torque_requested), 'Nm')} were requested"
    elif run.blends and run.plan.crossings:
        asked = plain(peak(run.series.torque_nominal), "Nm")
        subtitle += f"; the computed torque law alone requests up to {asked} on the way"
    if summary.not_completed_because:
        return "The motion was not completed", subtitle
    crossed = "Through the Type 2 singularity" if run.plan.crossings else ""
    stretched = "To the Type 1 singularity" if run.plan.meetings else ""
    if run.plan.working_mode_changes:
        stretched = "Through the Type 1 singularity"
    if crossed and stretched:
        return "Through the Type 2 and the Type 1 singularity", subtitle
    return crossed or stretched or "Within one assembly mode", subtitle


def _draw_crossing(axes: Axes, run: RunAnalysis, plane: Map) -> None:
    """Draw the robot at even steps along the first segment that crosses, and where it crossed."""
    draw_map(axes, plane)
    _draw_path(axes, run, 2.0)
    ghosts = _even_rows(run, GHOSTS)
    for number, row in enumerate(ghosts):
        alpha = 1.0 if row == ghosts[-1] else 0.14 + 0.07 * number
        _draw_posture(axes, run, row, INK, alpha, 3.0 + 0.1 * number)
    marks = [
        Line2D([], [], color=PURPLE, linewidth=2.2, label="Type 2 locus"),
        Line2D([], [], color=GREY, linewidth=1.4, label="Type 1 boundary"),
    ]
    crossed = _crossing_row(run)
    if crossed is not None:
        _draw_posture(axes, run, crossed, GREEN, 1.0, 4.5)
        marks.append(Line2D([], [], color=GREEN, linewidth=3.6, label="robot on the locus"))
    draw_base(axes, run.robot)
    frame(axes, run.robot, lowest(run.scenario.waypoints))
    axes.grid(visible=False)
    axes.legend(handles=marks, loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=3, borderpad=0.0)


def _draw_posture(axes: Axes, run: RunAnalysis, row: int, color: str, alpha: float, zorder: float) -> None:
    """Draw the robot as it was measured in one row of the series."""
    q11, _, q21, _ = run.series.joint_position[row].tolist()
    x, y, _, _ = run.series.platform[row].tolist()
    draw_robot(axes, run.robot, (q11, q21), (x, y), color, alpha, zorder=zorder)


def _segment(run: RunAnalysis) -> AnySegment:
    """Return the first segment that crosses the locus, or the first one."""
    crossings = run.plan.crossings
    return run.plan.path.segments[crossings[0].segment if crossings else 0]


def _rows_of_segment(run: RunAnalysis) -> IntArray:
    """Return the rows of the series that were recorded along that segment; the first row if there are none."""
    segment, time = _segment(run), run.series.time
    rows = np.flatnonzero((time >= segment.start_time) & (time <= segment.start_time + segment.duration + 1e-9))
    return rows if rows.size else np.zeros(1, dtype=np.int64)


def _even_rows(run: RunAnalysis, count: int) -> list[int]:
    """Return rows that are evenly spaced on the way along that segment, as far as the robot went."""
    rows = _rows_of_segment(run)
    steps = np.hypot(*np.diff(np.nan_to_num(run.series.platform[rows, :2]), axis=0).T)
    way = np.concatenate([[0.0], np.cumsum(steps)])
    marks = np.linspace(0.0, way[-1], count)
    return [int(rows[np.argmin(np.abs(way - mark))]) for mark in marks]


def _crossing_row(run: RunAnalysis) -> int | None:
    """Return the row nearest to the first change of the assembly mode, None if there was none."""
    det_a = run.series.det_a
    changes = np.flatnonzero(det_a[:-1] * det_a[1:] <= 0.0)
    if not changes.size:
        return None
    row = int(changes[0])
    return row if abs(det_a[row]) <= abs(det_a[row + 1]) else row + 1


def _postures(run: RunAnalysis) -> list[Posture]:
    """Return row, colour and name: the start, on the locus, and the end of the segment that leads there."""
    crossed, time = _crossing_row(run), run.series.time
    postures = [(0, INK, f"robot at {time[0]:.2f} s")]
    if crossed is not None:
        postures.append((crossed, GREEN, f"robot at {time[crossed]:.2f} s, on the locus"))
    last = int(_rows_of_segment(run)[-1])
    return [*postures, (last, FAR, f"robot at {time[last]:.2f} s")]


def _draw_path(axes: Axes, run: RunAnalysis, zorder: float) -> None:
    series = run.series
    _draw_reference(axes, run, zorder)
    for sign, color in ((1.0, BLUE), (-1.0, VERMILION)):
        here = np.sign(series.det_a) == sign
        x = np.where(here, series.platform[:, 0], np.nan) * 1e3
        y = np.where(here, series.platform[:, 1], np.nan) * 1e3
        axes.plot(x, y, color=color, linewidth=1.9, zorder=zorder + 0.2)


def _draw_reference(axes: Axes, run: RunAnalysis, zorder: float) -> None:
    corners = 1e3 * np.array(corners_of(run.plan))
    axes.plot(corners[:, 0], corners[:, 1], color="white", linewidth=6.5, zorder=zorder, solid_capstyle="round")
    axes.plot(corners[:, 0], corners[:, 1], color="#b9c0cc", linewidth=4.5, zorder=zorder + 0.1, solid_capstyle="round")


def _name_waypoints(axes: Axes, run: RunAnalysis) -> None:
    for number, (x, y) in enumerate(dict.fromkeys(run.scenario.waypoints)):
        axes.plot(1e3 * x, 1e3 * y, marker="o", markersize=5, color=INK, mec="white", zorder=7.0)
        axes.annotate(
            waypoint_name(number),
            (1e3 * x, 1e3 * y),
            (-9 if x < 0.0 else 9, 2),
            textcoords="offset points",
            ha="right" if x < 0.0 else "left",
            fontweight="bold",
            path_effects=[withStroke(linewidth=3, foreground="white")],
            zorder=8.0,
        )


def _legend(run: RunAnalysis) -> list[Line2D | Patch]:
    return [
        Line2D([], [], color="#b9c0cc", linewidth=4.5, label="reference path"),
        Line2D([], [], color=BLUE, label="actual path, det A > 0"),
        Line2D([], [], color=VERMILION, label="actual path, det A < 0"),
        Line2D([], [], color=PURPLE, linewidth=2.2, label="Type 2 locus, det A = 0"),
        Line2D([], [], color=GREY, linewidth=1.4, label="Type 1: end of the legs' reach"),
        Patch(facecolor=POSITIVE, edgecolor=BLUE, linewidth=0.5, label="assembly mode det A > 0"),
        Patch(facecolor=NEGATIVE, edgecolor=VERMILION, linewidth=0.5, label="assembly mode det A < 0"),
        *(Line2D([], [], color=color, linewidth=3.6, label=name) for _, color, name in _postures(run)),
    ]
