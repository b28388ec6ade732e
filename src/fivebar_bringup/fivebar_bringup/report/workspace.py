# SPDX-License-Identifier: Apache-2.0
"""The plane of the robot: where its legs reach, where the Type 2 locus is, and the robot itself."""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap
from matplotlib.patheffects import withStroke

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.pages.style import GREY, INK, PURPLE
from fivebar_control.model.geometry import elbow_position, workspace_bounds
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_control.workspace.fields import platform_grid
from fivebar_description.parameters import FiveBar

GRID = 150
"""Points along the longer side of the map; the locus lies within a tenth of a millimetre of where it is drawn."""

NEGATIVE, POSITIVE = "#fdf0e6", "#e8f1f8"
"""Tints of the two assembly modes, det A < 0 and > 0."""


class Map(NamedTuple):
    """The robot's plane in one working mode, in mm: x [m], y [n], and on the grid [n, m] det A and the reach."""

    x: FloatArray
    y: FloatArray
    det_a: FloatArray
    reach: FloatArray


@lru_cache(maxsize=4)
def survey(robot: FiveBar, modes: tuple[int, int], lowest: float) -> Map:
    """Return the map of where both legs reach, from y = `lowest` (m) upwards; det A is NaN out of reach."""
    bounds = workspace_bounds(robot)
    low, high = np.array([bounds.left, lowest]), np.array([bounds.right, bounds.top])
    grid = platform_grid(robot, low, high, GRID)
    determinants = np.full(grid.reach.shape, math.nan)
    for row, column in np.argwhere(grid.reach > 0.0).tolist():
        state = state_from_platform(robot, modes, float(grid.x[column]), float(grid.y[row]), 0.0, 0.0)
        determinants[row, column] = det_a(state)
    return Map(1e3 * grid.x, 1e3 * grid.y, determinants, 1e3 * grid.reach)


def draw_map(axes: Axes, plane: Map) -> None:
    """Draw both assembly modes, the Type 2 locus between them and the Type 1 boundary around them."""
    signs = ListedColormap([NEGATIVE, POSITIVE])
    axes.contourf(plane.x, plane.y, plane.det_a, levels=[-1.1, 0.0, 1.1], cmap=signs, zorder=0.6)
    axes.contour(plane.x, plane.y, plane.reach, levels=[0.0], colors=[GREY], linewidths=1.4, zorder=1.0)
    axes.contour(plane.x, plane.y, plane.det_a, levels=[0.0], colors=[PURPLE], linewidths=2.2, zorder=1.2)


def draw_robot(
    axes: Axes,
    robot: FiveBar,
    motors: tuple[float, float],
    place: tuple[float, float],
    color: str = INK,
    alpha: float = 1.0,
    width: float = 3.8,
    zorder: float = 3.0,
) -> None:
    """Draw the robot from its motor angles (rad) and the place of its platform (m)."""
    left, right = elbow_position(robot.leg1, motors[0]), elbow_position(robot.leg2, motors[1])
    x = [1e3 * mark for mark in (robot.leg1.base_x, left[0], place[0], right[0], robot.leg2.base_x)]
    y = [1e3 * mark for mark in (0.0, left[1], place[1], right[1], 0.0)]
    axes.plot(
        x, y, color=color, alpha=alpha, linewidth=width, solid_capstyle="round", solid_joinstyle="round", zorder=zorder
    )
    elbows, tip = slice(1, 4, 2), slice(2, 3)
    for joints, size, fill, edge in ((elbows, 1.5, "white", color), (tip, 2.0, color, "white")):
        axes.plot(
            x[joints],
            y[joints],
            linestyle="none",
            marker="o",
            markersize=size * width,
            markerfacecolor=fill,
            markeredgecolor=edge,
            markeredgewidth=0.35 * width,
            alpha=alpha,
            zorder=zorder + 0.1,
        )


def draw_base(axes: Axes, robot: FiveBar) -> None:
    """Draw the two motors."""
    for number, leg in enumerate((robot.leg1, robot.leg2), start=1):
        x = 1e3 * leg.base_x
        axes.plot(x, 0.0, marker="s", markersize=13, mfc=INK, mec="white", zorder=5.0)
        axes.annotate(
            f"motor {number}",
            (x, 0.0),
            (0, -14),
            textcoords="offset points",
            ha="center",
            va="top",
            fontsize=9,
            color=INK,
            path_effects=[withStroke(linewidth=3, foreground="white", alpha=0.8)],
            zorder=6.0,
        )


def frame(axes: Axes, robot: FiveBar, lowest: float) -> None:
    """Label the plane (mm) and set its limits, with both elbows in sight."""
    legs = (robot.leg1, robot.leg2)
    axes.set_aspect("equal")
    axes.set_xlim(
        1e3 * min(leg.base_x - leg.proximal for leg in legs) - 8.0,
        1e3 * max(leg.base_x + leg.proximal for leg in legs) + 8.0,
    )
    axes.set_ylim(1e3 * lowest, 1e3 * max(leg.proximal + leg.distal for leg in legs))
    axes.set_xlabel("x in mm")
    axes.set_ylabel("y in mm")
