# SPDX-License-Identifier: Apache-2.0
"""The figures of an assessment: where the robot crosses, and what would make it better."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.lines import Line2D

from fivebar_bringup.pages.content import Picture
from fivebar_bringup.pages.style import (
    AMBER,
    BLUE,
    GREEN,
    GREY,
    INK,
    VERMILION,
    house_style,
    legend_below,
    new_figure,
    png,
)
from fivebar_bringup.report.workspace import draw_base, draw_map, survey
from fivebar_control.model.geometry import workspace_bounds
from fivebar_control.planning.postures import WORKING_MODES, mode_name
from fivebar_description.robot_file import read_robot
from fivebar_studies.assess.rows import AssessRow
from fivebar_studies.assess.statistics import Change, by_case, random_runs

SHARES = ((0.9, GREEN, "o", "at least 90 %"), (0.5, AMBER, "s", "at least half"), (0.0, VERMILION, "X", "fewer"))
"""Colour, marker and words, by the least share of drawn robots that cross there."""


def crossing_map(robot: str, rows: Sequence[AssessRow], controller: str) -> Picture:
    """Draw the workspace in each working mode, and where how many of the drawn robots cross."""
    five_bar = read_robot(robot).five_bar()
    runs = random_runs(rows, controller)
    shares = by_case(runs)
    places = {row.case: row for row in runs if row.crossing_x is not None}
    with house_style():
        figure = new_figure(
            "Where the robot goes and crosses",
            "share of the robots drawn as declared that make a random crossing there; in mm, by working mode",
            9.0,
        )
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        bottom = workspace_bounds(five_bar).bottom
        for axes, modes in zip(panels.flat, WORKING_MODES, strict=True):
            draw_map(axes, survey(five_bar, modes, bottom))
            draw_base(axes, five_bar)
            most = 1.01
            for least, colour, marker, _ in SHARES:
                inside = [
                    (1e3 * (row.crossing_x or 0.0), 1e3 * (row.crossing_y or 0.0))
                    for case, row in places.items()
                    if (row.mode1, row.mode2) == modes and least <= shares[case] < most
                ]
                points = np.array(inside).reshape(-1, 2)
                look: dict[str, Any] = {"color": colour, "marker": marker, "edgecolor": "white"}
                axes.scatter(points[:, 0], points[:, 1], s=42, zorder=4, **look)
                most = least
            axes.set_aspect("equal")
            axes.grid(False)
            axes.set_title(f"working mode {mode_name(modes)}")
        keys = [
            Line2D([], [], linestyle="none", marker=marker, color=colour, markersize=7, label=f"{words} cross")
            for _, colour, marker, words in SHARES
        ]
        legend_below(figure, keys, len(keys))
        caption = (
            "Tinted: where both legs reach, by assembly mode. Purple: the Type 2 locus. Marks: places of random"
            " crossings, also those that the planner would refuse as too unlikely."
        )
        return Picture("crossings", caption, png(figure))


def change_chart(name: str, title: str, base: Change, changes: Sequence[Change], caption: str) -> Picture:
    """Draw the success with each change as bars, beside that of the robot as declared."""
    with house_style():
        figure = new_figure(title, "success over all random crossings within reach, %", 1.6 + 0.34 * len(changes))
        axes = figure.subplots()
        shown = list(reversed(changes))
        shares = [100.0 * change.success.share for change in shown]
        colours = [GREEN if change.sure else (VERMILION if -change.gain > change.spread else BLUE) for change in shown]
        spreads = [100.0 * change.spread for change in shown]
        axes.barh(range(len(shown)), shares, color=colours, xerr=spreads, ecolor=GREY, height=0.62)
        axes.axvline(100.0 * base.success.share, color=INK, linewidth=1.4, linestyle="--")
        axes.set_yticks(range(len(shown)), [change.words for change in shown])
        least = min(share - spread for share, spread in zip(shares, spreads, strict=True))
        axes.set_xlim(max(0.0, 10.0 * math.floor(0.1 * least)), 100.0)
        axes.grid(False, axis="y")
        return Picture(name, f"{caption} Dashed: as declared. Lines: 95 % intervals of the difference.", png(figure))
