# SPDX-License-Identifier: Apache-2.0
"""Figures that compare several runs."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import LogLocator, NullLocator

from fivebar_bringup.pages.style import (
    BLUE,
    GREEN,
    GREY,
    INK,
    PURPLE,
    VERMILION,
    house_style,
    log_axis,
    new_figure,
    png,
)
from fivebar_studies.reproduce.free_dynamics import FreeDynamics
from fivebar_studies.reproduce.verdicts import FINITE_TORQUE, PairedRuns

COLOURS = (BLUE, GREEN, PURPLE, VERMILION, GREY)
MARKERS = ("o", "s", "^", "D", "v")


class PointGroup(NamedTuple):
    """Points of one controller: x, y and whether the run was completed."""

    name: str
    x: tuple[float, ...]
    y: tuple[float, ...]
    completed: tuple[bool, ...]


def draw_peaks(groups: Sequence[PointGroup]) -> bytes:
    """Draw the largest torque that each run requested, controller by controller."""
    with house_style():
        figure = new_figure(
            "Largest torque requested", "one dot per run, crosses: not completed; the drives give up to 10 Nm", 4.4
        )
        axes = figure.subplots()
        for row, (group, colour) in enumerate(zip(groups, COLOURS, strict=False)):
            offsets = np.linspace(-0.22, 0.22, len(group.y)) if len(group.y) > 1 else np.zeros(1)
            for offset, peak, done in zip(offsets.tolist(), group.y, group.completed, strict=True):
                axes.plot(peak, row + offset, "o" if done else "X", color=colour, markersize=6, mec="white", mew=0.7)
        axes.axvline(FINITE_TORQUE, color=INK, linewidth=1.0, linestyle="--")
        axes.set_xscale("log")
        axes.set_yticks(range(len(groups)), [group.name for group in groups])
        axes.invert_yaxis()
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("largest torque requested of a motor in Nm")
        return png(figure)


def draw_residuals(groups: Sequence[PointGroup]) -> bytes:
    """Draw the torque that runs requested over how far their reference is from the dynamic criterion."""
    largest = max((value for group in groups for value in group.x), default=0.0)
    with house_style():
        figure = new_figure(
            "Torque over the violation of the dynamic criterion",
            "largest torque requested over the reference's |m tₛᵀẍ| on the locus; crosses: not completed",
            4.8,
        )
        axes = figure.subplots()
        for group, colour, marker in zip(groups, COLOURS, MARKERS, strict=False):
            for number, (x, y, done) in enumerate(zip(group.x, group.y, group.completed, strict=True)):
                axes.plot(
                    x,
                    y,
                    marker=marker if done else "X",
                    linestyle="none",
                    color=colour,
                    markersize=8 if done else 12,
                    markerfacecolor="none" if done else colour,
                    markeredgewidth=1.8 if done else 0.0,
                    label=group.name if number == 0 else None,
                )
        axes.axhline(FINITE_TORQUE, color=INK, linewidth=1.0, linestyle="--")
        log_axis(axes, 0.1, max((value for group in groups for value in group.y), default=10.0))
        axes.set_xlim(-0.02 * largest - 1e-3, 1.04 * largest + 1e-3)
        axes.set_xlabel("|m tₛᵀẍ| of the reference on the locus in N")
        axes.set_ylabel("torque requested in Nm")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=3, borderpad=0.0)
        return png(figure)


def draw_pairs(pairs: Sequence[PairedRuns]) -> bytes:
    """Draw each run's error with the adaptive gain and without it."""
    with house_style():
        figure = new_figure(
            "Error of the joint-space constraint with and without adaptive gain",
            "largest |h| of the motor angles in the blending zones; crosses: not completed",
            1.6 + 0.24 * len(pairs),
        )
        axes = figure.subplots()
        for row, pair in enumerate(pairs):
            _pair(axes, row, pair)
        axes.set_xscale("log")
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_yticks(range(len(pairs)), [pair.label for pair in pairs], fontsize=8.5)
        axes.invert_yaxis()
        axes.margins(y=0.02)
        axes.set_xlabel("error in rad")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=2, borderpad=0.0)
        return png(figure)


def _pair(axes: Axes, row: int, pair: PairedRuns) -> None:
    ends = (
        (pair.error_with, pair.completed_with, BLUE, "with"),
        (pair.error_without, pair.completed_without, VERMILION, "without"),
    )
    known = [error for error, _, _, _ in ends if error is not None]
    if len(known) == 2:
        axes.plot(known, [row, row], color=GREY, linewidth=1.0, zorder=1.5)
    for error, done, colour, name in ends:
        if error is not None:
            axes.plot(
                error, row, "o" if done else "X", color=colour, mec="white", mew=0.7, label=name if row == 0 else None
            )


def draw_free_dynamics(dynamics: FreeDynamics) -> bytes:
    """Draw how the force along t_s vanishes towards the locus, whatever the torques."""
    with house_style():
        figure = new_figure(
            "Free dynamics on the locus",
            f"|m tₛᵀẍ| by Pinocchio under {dynamics.torques} random torques of up to 10 Nm per state",
            4.4,
        )
        axes = figure.subplots()
        axes.plot(
            dynamics.distance, dynamics.along_at_distance, "o-", color=PURPLE, label="beside the locus, along the path"
        )
        axes.axhline(dynamics.force, color=GREY, linewidth=1.2, label="largest |m ẍ| on the locus")
        floor = max(dynamics.along, 1e-18)
        axes.axhline(floor, color=VERMILION, linestyle="--", label=f"largest in {dynamics.states} states on the locus")
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.yaxis.set_major_locator(LogLocator(base=10.0, numticks=9))
        axes.yaxis.set_minor_locator(NullLocator())
        axes.xaxis.set_minor_locator(NullLocator())
        axes.set_xlabel("distance from the locus in m")
        axes.set_ylabel("force in N")
        axes.legend(loc="lower right", bbox_to_anchor=(1.0, 0.99), ncols=3, borderpad=0.0)
        return png(figure)
