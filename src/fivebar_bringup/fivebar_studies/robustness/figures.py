# SPDX-License-Identifier: Apache-2.0
"""The figures of the study: the share of runs that fail, over the size of each effect."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LinearSegmentedColormap, Normalize
from matplotlib.figure import Figure

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.style import BLUE, GREY, INK, VERMILION, ZONE, house_style, new_figure, png
from fivebar_studies.robustness.effects import Effect
from fivebar_studies.robustness.equipment import equipment_named
from fivebar_studies.robustness.sensor_effects import ALL_EFFECTS
from fivebar_studies.robustness.tables import Climb

SHARES = LinearSegmentedColormap.from_list("shares", ["#eef1f5", ZONE, VERMILION, "#7a2f00"])
"""Nothing fails, to everything fails."""

PANELS = 4
"""At most, side by side."""

CAPTION = "Share of the runs that fail at each size. Empty rows: the robot has no gyroscope."


def share_figures(climbs: Sequence[Climb]) -> list[Picture]:
    """Return a figure for `unified` and one for the others, as far as there are climbs of theirs."""
    pictures = []
    with house_style():
        for name, title, unified in (
            ("unified", "What unified survives", True),
            ("blended", "What the other controllers survive", False),
        ):
            used = [equipment_named(name) for name in dict.fromkeys(climb.equipment for climb in climbs)]
            shown = [equipment.name for equipment in used if (equipment.controller == "unified") == unified][:PANELS]
            if shown:
                pictures.append(Picture(name, CAPTION, png(share_figure(shown, climbs, title))))
    return pictures


def share_figure(shown: Sequence[str], climbs: Sequence[Climb], title: str) -> Figure:
    """Return a figure with a panel for each equipment that is shown, and a row for each effect."""
    effects = [ALL_EFFECTS[effect] for effect in dict.fromkeys(climb.effect for climb in climbs)]
    of = {(climb.effect, climb.equipment): climb for climb in climbs}
    steps = max(len(effect.sizes) for effect in effects)
    figure = new_figure(
        title,
        "each row an effect alone, growing from left to right; blue and dark line: what a good and a middling robot"
        " have of it",
        2.2 + 0.27 * len(effects),
    )
    panels = figure.subplots(1, len(shown), sharey=True, squeeze=False)[0]
    for axes, equipment in zip(panels, shown, strict=True):
        axes.set_title(equipment.replace(", ", ",\n", 1))
        axes.grid(False)
        for row, effect in enumerate(effects):
            climb = of.get((effect.name, equipment))
            if climb is not None:
                shares = np.array(climb.failed, dtype=np.float64)[None, :] / climb.runs
                axes.imshow(
                    shares,
                    cmap=SHARES,
                    vmin=0.0,
                    vmax=1.0,
                    extent=(0.0, float(len(effect.sizes)), row + 0.45, row - 0.45),
                    aspect="auto",
                    interpolation="nearest",
                )
            _mark(axes, row, effect)
        axes.set_xlim(0.0, steps)
        axes.set_ylim(len(effects) - 0.5, -0.5)
        axes.set_xticks([])
    labels = [
        f"{effect.words.partition(',')[0]}: {effect.sizes[0]:g} … {effect.shown(effect.sizes[-1])}"
        for effect in effects
    ]
    panels[0].set_yticks(range(len(effects)), labels, fontsize=8.5)
    colours = ScalarMappable(Normalize(0.0, 100.0), SHARES)
    figure.colorbar(
        colours, ax=list(panels), orientation="horizontal", fraction=0.03, aspect=50, label="runs that fail, %"
    )
    return figure


def _mark(axes: Axes, row: int, effect: Effect) -> None:
    """Draw what a good and a middling robot have."""
    for size, colour in ((effect.good, BLUE), (effect.middling, INK)):
        if size is not None:
            place = place_of(effect, size)
            axes.plot((place, place), (row - 0.45, row + 0.45), color=colour, linewidth=1.8, zorder=3)
    axes.axhline(row + 0.5, color=GREY, linewidth=0.3, zorder=2)


def place_of(effect: Effect, size: float) -> float:
    """Return where a size is on the axis of its row: a step's number and a half in its middle, 0 for less than all."""
    places = np.arange(len(effect.sizes)) + 0.5
    logs = np.log(np.array(effect.sizes))
    order = slice(None, None, -1) if effect.falls else slice(None)
    return float(np.interp(np.log(size), logs[order], places[order]))
