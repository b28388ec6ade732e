"""What the figures are made of: the two planes, their fields, the loci on them, and the legend."""

from __future__ import annotations

import math
from collections.abc import Iterable

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.colors import Colormap, ListedColormap, to_rgb
from matplotlib.image import AxesImage
from matplotlib.lines import Line2D
from matplotlib.patches import Patch
from matplotlib.patheffects import withStroke
from scipy.ndimage import distance_transform_edt

from fivebar_bringup.maps.fields import WORKING_MODES, Fields, FloatArray
from fivebar_bringup.maps.loci import Curve, Loci
from fivebar_bringup.maps.measures import continued
from fivebar_bringup.report.style import BLUE, GREEN, GREY, INK, PURPLE, VERMILION, ZONE
from fivebar_description.parameters import FiveBar

MM = 1e3
TURN = 360.0
EDGE = 12.0
"""Room (mm) around what is drawn in the platform's plane."""

DASHES = {"stretched": "-", "folded": (0, (3.2, 1.3))}
"""How a locus is drawn for either shape of the links that are aligned."""


def tint(color: str, strength: float) -> tuple[float, float, float]:
    """Return a colour mixed with white; strength 1 leaves it as it is."""
    red, green, blue = (1.0 - strength * (1.0 - part) for part in to_rgb(color))
    return red, green, blue


POSITIVE, NEGATIVE = tint(BLUE, 0.28), tint(VERMILION, 0.28)
ASSEMBLY = ListedColormap([NEGATIVE, POSITIVE])
MODE_TINTS = (tint(BLUE, 0.3), tint(ZONE, 0.75), tint(GREEN, 0.3), tint("#cc79a7", 0.4))
MODE_COLORS = ListedColormap(list(MODE_TINTS))
PLAIN = ListedColormap([tint(GREY, 0.18)])
KAPPA: Colormap = mpl.colormaps["cividis"]
OUTLINE = [withStroke(linewidth=3, foreground="white")]


def mode_name(modes: tuple[int, int]) -> str:
    """Return a working mode as a person writes it."""
    return "(" + ", ".join("+1" if mode > 0 else "−1" for mode in modes) + ")"


def platform_frame(axes: Axes, robot: FiveBar, fields: Fields) -> None:
    """Label the platform's plane (mm) and set its limits to the workspace and everywhere that an elbow gets."""
    grid = fields.platform_grid
    legs = (robot.leg1, robot.leg2)
    left = min(float(grid.x[0]), *(leg.base_x - leg.proximal for leg in legs))
    right = max(float(grid.x[-1]), *(leg.base_x + leg.proximal for leg in legs))
    half = max(float(grid.y[-1]), *(leg.proximal for leg in legs))
    axes.set_aspect("equal")
    axes.grid(False)
    axes.set_xlim(MM * left - EDGE, MM * right + EDGE)
    axes.set_ylim(-MM * half - EDGE, MM * half + EDGE)
    axes.set_xlabel("x in mm")
    axes.set_ylabel("y in mm")


def platform_field(axes: Axes, fields: Fields, values: FloatArray, colors: Colormap, low: float, high: float) -> AxesImage:
    """Paint values [n, m] over the workspace, up to its very edge."""
    grid = fields.platform_grid
    half = 0.5 * grid.cell
    extent = MM * np.array([grid.x[0] - half, grid.x[-1] + half, grid.y[0] - half, grid.y[-1] + half])
    image = _paint(axes, values, colors, low, high, extent)
    outside = float(np.min(grid.reach)) - 1.0
    axes.contourf(MM * grid.x, MM * grid.y, grid.reach, levels=[outside, 0.0], colors=["white"], zorder=0.7)
    _blank_rim(axes, extent, MM * grid.cell)
    return image


def motor_frame(axes: Axes) -> None:
    """Label the plane of the motor angles (degrees)."""
    axes.set_aspect("equal")
    axes.grid(False)
    marks = np.arange(-180, 181, 90)
    for which, label in ((axes.xaxis, "q₁₁, motor 1, in degrees"), (axes.yaxis, "q₂₁, motor 2, in degrees")):
        which.set_ticks(marks)
        which.set_label_text(label)
    axes.set_xlim(-180.0, 180.0)
    axes.set_ylim(-180.0, 180.0)
    for spine in axes.spines.values():
        spine.set_visible(True)


def motor_field(axes: Axes, fields: Fields, values: FloatArray, colors: Colormap, low: float, high: float) -> AxesImage:
    """Paint values [n, n] over where the loop closes, up to its very edge."""
    grid = fields.motor_grid
    image = _paint(axes, values, colors, low, high, np.array([-180.0, 180.0, -180.0, 180.0]))
    around = np.pad(grid.closure, 1, mode="wrap")
    cell = TURN / len(grid.q)
    q = np.degrees(np.concatenate([[grid.q[0]], grid.q, [grid.q[-1]]])) + np.concatenate([[-cell], 0.0 * grid.q, [cell]])
    outside = float(np.min(around)) - 1.0
    axes.contourf(q, q, around, levels=[outside, 0.0], colors=["#f1f2f4"], zorder=0.7)
    return image


def _paint(axes: Axes, values: FloatArray, colors: Colormap, low: float, high: float, extent: FloatArray) -> AxesImage:
    left, right, bottom, top = extent.tolist()
    return axes.imshow(
        continued(values),
        origin="lower",
        extent=(left, right, bottom, top),
        cmap=colors,
        vmin=low,
        vmax=high,
        interpolation="nearest",
        aspect="equal",
        zorder=0.6,
    )


def _blank_rim(axes: Axes, extent: FloatArray, cell: float) -> None:
    """Whiten the outer half cells, which lie beyond the last centres and so beyond the contour of the reach."""
    left, right, bottom, top = extent.tolist()
    x, y = [left, right, right, left, left], [bottom, bottom, top, top, bottom]
    axes.plot(x, y, color="white", linewidth=2.0 * cell, zorder=0.7)


def platform_loci(axes: Axes, loci: Loci, modes: tuple[int, int] | None, color: str = PURPLE) -> None:
    """Draw Type 1, and of one working mode (None: of all) Type 2 and Type 3."""
    for edge in loci.type1:
        _line(axes, MM * edge.curve.platform, INK, 1.5, DASHES[edge.shape])
    for piece in loci.type2:
        if modes in (None, piece.working_mode):
            _line(axes, MM * piece.curve.platform, color, 2.3, DASHES[piece.shape])
    x = [MM * point.x for point in loci.type3 if modes is None or modes in point.working_modes]
    y = [MM * point.y for point in loci.type3 if modes is None or modes in point.working_modes]
    axes.plot(x, y, **TYPE3_MARKER)


def motor_loci(axes: Axes, loci: Loci, assembly: int, color: str = PURPLE) -> None:
    """Draw Type 1 of one assembly mode, Type 2 around it, and Type 3."""
    for edge in loci.type1:
        if edge.assembly == assembly:
            _periodic(axes, edge.curve, LEG_COLORS[edge.leg], 1.7, DASHES[edge.shape])
    for piece in loci.type2:
        if np.max(np.ptp(piece.curve.joints[:, ::2], axis=0)) < 1e-6:
            x, y = np.degrees(piece.curve.joints[0, ::2])
            axes.plot(x, y, marker="o", markersize=8, mfc="white", mec=color, mew=2.3, linestyle="none", zorder=3.4)
        else:
            _periodic(axes, piece.curve, color, 2.6, DASHES[piece.shape])
    motors = [(math.degrees(point.joints.q11), math.degrees(point.joints.q21)) for point in loci.type3]
    axes.plot([q11 for q11, _ in motors], [q21 for _, q21 in motors], **TYPE3_MARKER)


LEG_COLORS = {1: INK, 2: GREY}

TYPE3_MARKER = {
    "linestyle": "none",
    "marker": "D",
    "markersize": 6.0,
    "markerfacecolor": ZONE,
    "markeredgecolor": INK,
    "markeredgewidth": 1.1,
    "zorder": 5.5,
}


def _periodic(axes: Axes, curve: Curve, color: str, width: float, dashes: object) -> None:
    """Draw a curve of motor angles once for every period in which a part of it is in sight."""
    motors = np.degrees(np.unwrap(curve.joints[:, ::2], axis=0))
    low, high = np.min(motors, axis=0), np.max(motors, axis=0)
    first, last = np.ceil((-180.0 - high) / TURN), np.floor((180.0 - low) / TURN)
    for across in np.arange(first[0], last[0] + 1.0):
        for up in np.arange(first[1], last[1] + 1.0):
            _line(axes, motors + TURN * np.array([across, up]), color, width, dashes)


def _line(axes: Axes, points: FloatArray, color: str, width: float, dashes: object) -> None:
    axes.plot(points[:, 0], points[:, 1], color=color, linewidth=width, linestyle=dashes, zorder=2.0)  # type: ignore[arg-type]


def name_region(axes: Axes, text: str, x: FloatArray, y: FloatArray, inside: FloatArray, keep_off: Iterable[tuple[float, float]] = ()) -> None:
    """Write a name where a region [n, m] is widest, away from some places."""
    room = distance_transform_edt(np.pad(inside, 1))[1:-1, 1:-1]
    across, up = np.meshgrid(x, y)
    cell = float(x[1] - x[0])
    for place in keep_off:
        room = np.minimum(room, np.hypot(across - place[0], up - place[1]) / cell)
    row, column = np.unravel_index(int(np.argmax(room)), room.shape)
    if room[row, column] < 3.0:
        return
    axes.text(
        float(x[column]), float(y[row]), text, ha="center", va="center", fontsize=9.5, path_effects=OUTLINE, zorder=6.0
    )


def outline_texts(axes: Axes) -> None:
    """Set off all texts on the axes from what is painted under them."""
    for text in axes.texts:
        text.set_path_effects(OUTLINE)  # type: ignore[arg-type]


def locus_keys(color: str = PURPLE) -> list[Line2D]:
    """Return the legend's entries for the Type 2 locus."""
    return [
        Line2D([], [], color=color, linewidth=2.3, label="Type 2 (det A = 0): distal links stretched"),
        Line2D([], [], color=color, linewidth=2.3, linestyle=DASHES["folded"], label="Type 2: distal links folded"),  # type: ignore[arg-type]
    ]


def type1_keys() -> list[Line2D]:
    """Return the legend's entries for Type 1 in the platform's plane."""
    return [
        Line2D([], [], color=INK, linewidth=1.5, label="Type 1 (det B = 0): a leg stretched"),
        Line2D([], [], color=INK, linewidth=1.5, linestyle=DASHES["folded"], label="Type 1: a leg folded"),  # type: ignore[arg-type]
    ]


def leg_keys() -> list[Line2D]:
    """Return the legend's entries for Type 1 in the plane of the motor angles."""
    return [
        Line2D([], [], color=LEG_COLORS[leg], linewidth=1.7, linestyle=DASHES[shape], label=f"Type 1: leg {leg} {shape}")  # type: ignore[arg-type]
        for leg in (1, 2)
        for shape in ("stretched", "folded")
    ]


def type3_key() -> Line2D:
    """Return the legend's entry for Type 3."""
    return Line2D([], [], **TYPE3_MARKER, label="Type 3: both at once")


def assembly_keys() -> list[Patch]:
    """Return the legend's entries for the assembly modes."""
    return [Patch(facecolor=POSITIVE, label="assembly mode det A > 0"), Patch(facecolor=NEGATIVE, label="assembly mode det A < 0")]


def mode_keys() -> list[Patch]:
    """Return the legend's entries for the working modes."""
    return [
        Patch(facecolor=color, label=f"working mode {mode_name(modes)}")
        for modes, color in zip(WORKING_MODES, MODE_TINTS, strict=True)
    ]
