"""The plane of the robot: where its legs reach, where the Type 2 locus is, and the robot itself."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import ListedColormap

from fivebar_bringup.bag.recording import FloatArray
from fivebar_bringup.report.style import GREY, INK, PURPLE
from fivebar_control.model.geometry import inverse_geometry, reach_margin
from fivebar_control.model.kinematics import det_a, state_from_platform
from fivebar_description.parameters import FiveBar

GRID = 150
"""Points per side of the map; the locus lies within a tenth of a millimetre of where it is drawn."""

NEGATIVE, POSITIVE = "#fdf0e6", "#e8f1f8"
"""Tints of the two assembly modes, det A < 0 and > 0."""


class Map(NamedTuple):
    """The robot's plane in one working mode, in mm: x [m], y [n], and on the grid [n, m] det A and the reach."""

    x: FloatArray
    y: FloatArray
    det_a: FloatArray
    reach: FloatArray


def survey(robot: FiveBar, mode1: int, mode2: int) -> Map:
    """Return the map of the half plane in which both legs reach; det A is NaN out of reach."""
    legs = (robot.leg1, robot.leg2)
    left = max(leg.base_x - leg.proximal - leg.distal for leg in legs)
    right = min(leg.base_x + leg.proximal + leg.distal for leg in legs)
    top = max(leg.proximal + leg.distal for leg in legs)
    margin = 0.004
    x = np.linspace(left - margin, right + margin, GRID)
    y = np.linspace(-0.35 * top, top, GRID)
    determinant = np.full((GRID, GRID), math.nan)
    reach = np.empty((GRID, GRID))
    for row, y_mark in enumerate(y.tolist()):
        for column, x_mark in enumerate(x.tolist()):
            reach[row, column] = min(reach_margin(leg, x_mark, y_mark) for leg in legs)
            if reach[row, column] > 0.0:
                determinant[row, column] = det_a(state_from_platform(robot, mode1, mode2, x_mark, y_mark, 0.0, 0.0))
    return Map(1e3 * x, 1e3 * y, determinant, 1e3 * reach)


def draw_map(axes: Axes, plane: Map) -> None:
    """Draw both assembly modes, the Type 2 locus between them and the Type 1 boundary around them."""
    signs = ListedColormap([NEGATIVE, POSITIVE])
    axes.contourf(plane.x, plane.y, np.sign(plane.det_a), levels=[-1.5, 0.0, 1.5], cmap=signs, zorder=0.6)
    axes.contour(plane.x, plane.y, plane.reach, levels=[0.0], colors=[GREY], linewidths=1.4, zorder=1.0)
    axes.contour(plane.x, plane.y, plane.det_a, levels=[0.0], colors=[PURPLE], linewidths=2.2, zorder=1.2)


def draw_robot(
    axes: Axes,
    robot: FiveBar,
    modes: tuple[int, int],
    place: tuple[float, float],
    color: str = INK,
    alpha: float = 1.0,
    width: float = 4.0,
    zorder: float = 3.0,
) -> None:
    """Draw the robot with its platform at a place (m) in a working mode."""
    q = inverse_geometry(robot, *modes, *place)
    x, y = [1e3 * robot.leg1.base_x], [0.0]
    for leg, angle, backwards in ((robot.leg1, q.q11, False), (robot.leg2, q.q21, True)):
        elbow = (1e3 * (leg.base_x + leg.proximal * math.cos(angle)), 1e3 * leg.proximal * math.sin(angle))
        chain = [elbow, (1e3 * place[0], 1e3 * place[1])]
        for mark in chain[:1] if backwards else chain:
            x.append(mark[0])
            y.append(mark[1])
    x.append(1e3 * robot.leg2.base_x)
    y.append(0.0)
    axes.plot(
        x, y, color=color, alpha=alpha, linewidth=width, solid_capstyle="round", solid_joinstyle="round", zorder=zorder
    )
    joints = {"linestyle": "none", "zorder": zorder + 0.1, "markeredgewidth": 0.35 * width}
    axes.plot(x[1:4:2], y[1:4:2], marker="o", markersize=1.5 * width, mfc="white", mec=color, alpha=alpha, **joints)
    axes.plot(x[2], y[2], marker="o", markersize=2.0 * width, mfc=color, mec="white", alpha=alpha, **joints)


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
            zorder=6.0,
        )


def frame(axes: Axes, robot: FiveBar, low: float, high: float) -> None:
    """Set limits (mm) and labels of the plane, with both elbows in sight."""
    side = 1e3 * max(abs(leg.base_x) + leg.proximal for leg in (robot.leg1, robot.leg2)) + 8.0
    axes.set_aspect("equal")
    axes.set_xlim(-side, side)
    axes.set_ylim(low, high)
    axes.set_xlabel("x in mm")
    axes.set_ylabel("y in mm")
