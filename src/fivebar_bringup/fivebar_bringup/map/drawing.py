# SPDX-License-Identifier: Apache-2.0
"""Drawing of fields and loci in the plane of the platform and in that of the motor angles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, ListedColormap, to_rgb
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import AbstractPathEffect, withStroke
from numpy.typing import NDArray
from scipy.ndimage import distance_transform_edt

from fivebar_bringup.map.measures import continued
from fivebar_bringup.pages.style import BLUE, GREEN, GREY, INK, PURPLE, VERMILION, ZONE
from fivebar_control.planning.postures import WORKING_MODES
from fivebar_control.workspace.fields import Fields, FloatArray
from fivebar_control.workspace.loci import Curve, Loci, Shape
from fivebar_description.parameters import FiveBar

Places = Sequence[tuple[float, float]]

MM = 1e3
TURN = 360.0
TEXT_EDGE = 4.0
"""Room (mm) between a text in a corner and the edge."""

EDGE = 12.0
"""Room (mm) around what is drawn in the platform's plane."""

GAP = 0.1
"""Angles (rad) on a circle that are farther apart belong to different arcs."""

POINT = 1e-6
"""A curve of motor angles (rad) that is no larger is a single point."""


def tint(color: str, strength: float) -> tuple[float, float, float]:
    """Return a colour mixed with white; strength 1 leaves it as it is."""
    red, green, blue = (1.0 - strength * (1.0 - part) for part in to_rgb(color))
    return red, green, blue


ASSEMBLY_COLORS = {1: BLUE, -1: VERMILION}
ASSEMBLY_TINTS = {sign: tint(color, 0.28) for sign, color in ASSEMBLY_COLORS.items()}
MODE_TINTS = (tint(BLUE, 0.3), tint(ZONE, 0.75), tint(GREEN, 0.3), tint("#cc79a7", 0.4))
PLAIN = ListedColormap([tint(GREY, 0.18)])
ASSEMBLIES = ListedColormap([ASSEMBLY_TINTS[-1], ASSEMBLY_TINTS[1]])
MODES = ListedColormap(list(MODE_TINTS))
KAPPA: Colormap = mpl.colormaps["cividis"]
OUT_OF_REACH = "#f1f2f4"

LEG_COLORS = {1: INK, 2: GREY}
DASHES: dict[Shape, Any] = {"stretched": "-", "folded": (0, (3.2, 1.3))}
"""How a locus is drawn for either shape of the links that are aligned."""

TYPE1_WIDTH, TYPE2_WIDTH = 1.6, 2.4
TYPE3_MARKER: dict[str, Any] = {
    "linestyle": "none",
    "marker": "D",
    "markersize": 6.0,
    "markerfacecolor": ZONE,
    "markeredgecolor": INK,
    "markeredgewidth": 1.1,
}


def outline(width: float = 3.0) -> list[AbstractPathEffect]:
    """Return the white line (points) around texts and lines that sets them off from what is painted under them."""
    return [withStroke(linewidth=width, foreground="white")]


def platform_limits(robot: FiveBar, fields: Fields) -> tuple[float, float, float]:
    """Return left, right and the same distance up and down (mm): the workspace and everywhere that an elbow gets."""
    grid = fields.platform_grid
    legs = (robot.leg1, robot.leg2)
    left = min(float(grid.x[0]), *(leg.base_x - leg.proximal for leg in legs))
    right = max(float(grid.x[-1]), *(leg.base_x + leg.proximal for leg in legs))
    half = max(float(grid.y[-1]), *(leg.proximal for leg in legs))
    return MM * left - EDGE, MM * right + EDGE, MM * half + EDGE


def platform_frame(axes: Axes, robot: FiveBar, fields: Fields) -> None:
    """Label the platform's plane (mm) and set its limits."""
    left, right, half = platform_limits(robot, fields)
    axes.set_aspect("equal")
    axes.grid(False)
    axes.set_xlim(left, right)
    axes.set_ylim(-half, half)
    axes.set_xlabel("x in mm")
    axes.set_ylabel("y in mm")


def motor_frame(axes: Axes) -> None:
    """Label the plane of the motor angles (degrees)."""
    axes.set_aspect("equal")
    axes.grid(False)
    for which, label in ((axes.xaxis, "q₁₁, motor 1, in degrees"), (axes.yaxis, "q₂₁, motor 2, in degrees")):
        which.set_ticks(np.arange(-180, 181, 90))
        which.set_label_text(label)
    axes.set_xlim(-180.0, 180.0)
    axes.set_ylim(-180.0, 180.0)
    for spine in axes.spines.values():
        spine.set_visible(True)


def platform_field(
    axes: Axes, fields: Fields, values: FloatArray, colors: Colormap, low: float, high: float
) -> AxesImage:
    """Paint values [n, m] over the workspace, up to its very edge."""
    grid = fields.platform_grid
    half = 0.5 * grid.cell
    sides = MM * np.array([grid.x[0] - half, grid.x[-1] + half, grid.y[0] - half, grid.y[-1] + half])
    image = _paint(axes, values, colors, (low, high), sides)
    # one more row and column on each side, so that the white reaches beyond what is painted
    x, y = (MM * _widened(centres, grid.cell) for centres in (grid.x, grid.y))
    _cover(axes, x, y, np.pad(grid.reach, 1, mode="edge"), "white")
    return image


def motor_field(axes: Axes, fields: Fields, values: FloatArray, colors: Colormap, low: float, high: float) -> AxesImage:
    """Paint values [n, n] over where the loop closes, up to its very edge."""
    grid = fields.motor_grid
    image = _paint(axes, values, colors, (low, high), np.array([-180.0, 180.0, -180.0, 180.0]))
    q = _widened(np.degrees(grid.q), TURN / len(grid.q))
    _cover(axes, q, q, np.pad(grid.closure, 1, mode="wrap"), OUT_OF_REACH)
    return image


def _widened(centres: FloatArray, cell: float) -> FloatArray:
    return np.concatenate([[centres[0] - cell], centres, [centres[-1] + cell]])


def _paint(
    axes: Axes, values: FloatArray, colors: Colormap, limits: tuple[float, float], sides: FloatArray
) -> AxesImage:
    left, right, bottom, top = sides.tolist()
    return axes.imshow(
        continued(values),
        origin="lower",
        extent=(left, right, bottom, top),
        cmap=colors,
        vmin=limits[0],
        vmax=limits[1],
        interpolation="nearest" if isinstance(colors, ListedColormap) and colors.N < 10 else "bilinear",
        zorder=0.6,
    )


def _cover(axes: Axes, x: FloatArray, y: FloatArray, margin: FloatArray, color: str) -> None:
    """Hide what is painted where a margin is negative; cells are square, the margin's zero is a smooth line."""
    lowest = float(np.min(margin))
    if lowest < 0.0:
        axes.contourf(x, y, margin, levels=[lowest - 1.0, 0.0], colors=[color], zorder=0.7)


def platform_type1(axes: Axes, loci: Loci) -> None:
    """Draw Type 1 in the platform's plane, where several pieces cover the same arc, each arc once."""
    for leg in LEG_COLORS:
        for shape in DASHES:
            curves = [edge.curve for edge in loci.type1 if (edge.leg, edge.shape) == (leg, shape)]
            if curves:
                angles = np.concatenate([curve.joints[:, 0 if leg == 1 else 2] for curve in curves])
                points = np.concatenate([curve.platform for curve in curves])
                _line(axes, MM * _once_around(angles, points), INK, TYPE1_WIDTH, shape)


def _once_around(angles: FloatArray, points: FloatArray) -> FloatArray:
    """Return points [n, 2] on a circle in the order of their angles (rad), with NaN between its arcs."""
    order = np.argsort(angles)
    order = np.append(order, order[0])
    gaps = np.flatnonzero(np.diff(angles[order]) % (2.0 * np.pi) > GAP)
    return np.insert(points[order], gaps + 1, np.nan, axis=0)


def platform_type2(axes: Axes, loci: Loci, modes: tuple[int, int], cased: bool = False) -> None:
    """Draw Type 2 of one working mode in the platform's plane."""
    for piece in loci.type2:
        if piece.working_mode == modes:
            _line(axes, MM * piece.curve.platform, PURPLE, TYPE2_WIDTH, piece.shape, cased)


def platform_type3(axes: Axes, loci: Loci, modes: tuple[int, int] | None = None) -> None:
    """Draw Type 3 of one working mode, or of all, in the platform's plane."""
    points = [point for point in loci.type3 if modes is None or modes in point.working_modes]
    axes.plot([MM * point.x for point in points], [MM * point.y for point in points], **TYPE3_MARKER, zorder=5.5)


def motor_loci(axes: Axes, loci: Loci, assembly: int, cased: bool = False) -> None:
    """Draw Type 1 of one assembly mode, Type 2 around it, and Type 3 in the plane of the motor angles."""
    for edge in loci.type1:
        if edge.assembly == assembly:
            _periodic(axes, edge.curve, LEG_COLORS[edge.leg], TYPE1_WIDTH, edge.shape, cased)
    for piece in loci.type2:
        if np.max(np.ptp(piece.curve.joints[:, ::2], axis=0)) < POINT:
            q11, q21 = np.degrees(piece.curve.joints[0, ::2]).tolist()
            axes.plot(q11, q21, marker="o", markersize=14, mfc="none", mec=PURPLE, mew=TYPE2_WIDTH, zorder=3.4)
        else:
            _periodic(axes, piece.curve, PURPLE, TYPE2_WIDTH, piece.shape, cased)
    motors = np.degrees([(point.joints.q11, point.joints.q21) for point in loci.type3]).reshape(-1, 2)
    axes.plot(motors[:, 0], motors[:, 1], **TYPE3_MARKER, zorder=5.5)


def _periodic(axes: Axes, curve: Curve, color: str, width: float, shape: Shape, cased: bool) -> None:
    """Draw a curve of motor angles once for every period in which a part of it is in sight."""
    motors = np.degrees(np.unwrap(curve.joints[:, ::2], axis=0))
    low, high = np.min(motors, axis=0), np.max(motors, axis=0)
    first, last = np.ceil((-180.0 - high) / TURN), np.floor((180.0 - low) / TURN)
    for across in np.arange(first[0], last[0] + 1.0):
        for up in np.arange(first[1], last[1] + 1.0):
            _line(axes, motors + TURN * np.array([across, up]), color, width, shape, cased)


def _line(axes: Axes, points: FloatArray, color: str, width: float, shape: Shape, cased: bool = False) -> None:
    """Draw points [n, 2] as a line, with a white line around it if `cased`."""
    effects = outline(width + 2.2) if cased else None
    axes.plot(*points.T, color=color, linewidth=width, linestyle=DASHES[shape], path_effects=effects, zorder=2.0)


def name_region(
    axes: Axes, text: str, x: FloatArray, y: FloatArray, inside: NDArray[np.bool_], keep_off: Places = ()
) -> tuple[float, float] | None:
    """Write a name where a region [n, m] is widest, away from some places, and return where; None in a tiny region."""
    room = distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1]
    across, up = np.meshgrid(x, y)
    for place in keep_off:
        room = np.minimum(room, 0.6 * np.hypot(across - place[0], up - place[1]) / float(x[1] - x[0]))
    row, column = np.unravel_index(int(np.argmax(room)), room.shape)
    if room[row, column] < 0.02 * max(room.shape):
        return None
    spot = float(x[column]), float(y[row])
    _write(axes, text, spot)
    return spot


def name_curves(axes: Axes, loci: Loci, modes: tuple[int, int]) -> None:
    """Write in a free corner of the platform's plane what either shape of the Type 2 locus is, with a line to it."""
    (left, right), (bottom, top) = axes.get_xlim(), axes.get_ylim()
    corners = [(x, y) for y in (top, bottom) for x in (left, right)]
    for shape in DASHES:
        pieces = [p.curve.platform for p in loci.type2 if p.working_mode == modes and p.shape == shape]
        if pieces:
            points = MM * np.concatenate(pieces)
            apart = [np.hypot(points[:, 0] - x, points[:, 1] - y) for x, y in corners]
            nearest = int(np.argmin([np.min(distances) for distances in apart]))
            x, y = corners.pop(nearest)
            axes.annotate(
                f"Type 2:\ndistal links {shape}",
                points[int(np.argmin(apart[nearest]))],
                (x + TEXT_EDGE * np.sign(left + right - 2.0 * x), y + TEXT_EDGE * np.sign(bottom + top - 2.0 * y)),
                color=PURPLE,
                fontsize=9,
                ha="left" if x == left else "right",
                va="bottom" if y == bottom else "top",
                arrowprops={"arrowstyle": "-", "color": PURPLE, "linewidth": 0.9, "shrinkB": 1.0},
                zorder=2.5,
            )


def _write(axes: Axes, text: str, place: tuple[float, float]) -> None:
    axes.text(*place, text, ha="center", va="center", fontsize=9.5, path_effects=outline(), zorder=6.0)


def outline_texts(axes: Axes) -> None:
    """Set off all texts on the axes from what is painted under them."""
    for text in axes.texts:
        text.set_path_effects(outline())


def type2_keys() -> list[Line2D]:
    """Return the legend's entries for the Type 2 locus."""
    names: dict[Shape, str] = {
        "stretched": "Type 2, det A = 0: distal links stretched",
        "folded": "Type 2, det A = 0: distal links folded",
    }
    return [_key(PURPLE, TYPE2_WIDTH, shape, name) for shape, name in names.items()]


def type1_keys() -> list[Line2D]:
    """Return the legend's entries for Type 1 in the platform's plane."""
    return [_key(INK, TYPE1_WIDTH, shape, f"Type 1, det B = 0: a leg {shape}") for shape in DASHES]


def leg_keys() -> list[Line2D]:
    """Return the legend's entries for Type 1 in the plane of the motor angles."""
    return [
        _key(LEG_COLORS[leg], TYPE1_WIDTH, shape, f"Type 1: leg {leg} {shape}") for leg in (1, 2) for shape in DASHES
    ]


def _key(color: str, width: float, shape: Shape, name: str) -> Line2D:
    return Line2D([], [], color=color, linewidth=width, linestyle=DASHES[shape], label=name)


def type3_key() -> Line2D:
    """Return the legend's entry for Type 3."""
    return Line2D([], [], **TYPE3_MARKER, label="Type 3: both at once")


def assembly_keys() -> list[Patch]:
    """Return the legend's entries for the assembly modes."""
    return [Patch(facecolor=ASSEMBLY_TINTS[sign], label=assembly_mode_label(sign)) for sign in (1, -1)]


def mode_keys() -> list[Patch]:
    """Return the legend's entries for the working modes."""
    return [
        Patch(facecolor=color, label=f"working mode {working_mode_label(modes)}")
        for modes, color in zip(WORKING_MODES, MODE_TINTS, strict=True)
    ]


def working_mode_label(modes: tuple[int, int]) -> str:
    """Return the name of a working mode."""
    return "(" + ", ".join("+1" if mode > 0 else "−1" for mode in modes) + ")"


def assembly_mode_label(assembly: int) -> str:
    """Return the name of an assembly mode."""
    return f"assembly mode det A {'>' if assembly > 0 else '<'} 0"
