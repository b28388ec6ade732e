# SPDX-License-Identifier: Apache-2.0
"""The figures of a map."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D

from fivebar_bringup.map import drawing
from fivebar_bringup.map.drawing import ASSEMBLY_COLORS, MM, assembly_mode_label, working_mode_label
from fivebar_bringup.map.examples import Examples
from fivebar_bringup.map.measures import Measures
from fivebar_bringup.pages.style import GREY, INK, PURPLE, VERMILION, WIDTH, legend_below, new_figure
from fivebar_bringup.report.workspace import draw_base, draw_robot
from fivebar_control.model.kinematics import assembly_mode
from fivebar_control.model.singularity import parallel_svd
from fivebar_control.model.state import State
from fivebar_control.planning.postures import WORKING_MODES
from fivebar_control.workspace.fields import ASSEMBLY_MODES, Fields, FloatArray
from fivebar_control.workspace.loci import Loci
from fivebar_description.parameters import FiveBar

POSTURE_MARKER: dict[str, Any] = {
    "linestyle": "none",
    "marker": "o",
    "markersize": 7.5,
    "mfc": INK,
    "mec": "white",
    "mew": 1.3,
}

ARROW = 42.0
"""Length (mm) of half a double arrow."""


class Survey(NamedTuple):
    """The computed geometry of a robot: loci, fields, measures, postures to draw."""

    name: str
    robot: FiveBar
    loci: Loci
    fields: Fields
    measures: Measures
    examples: Examples


def postures(survey: Survey) -> Figure:
    """Draw the robot in both assembly modes, and in a singular posture of each type."""
    width = 12.0
    figure = new_figure(
        "Two assembly modes, three kinds of singular posture",
        f"{survey.name}: both legs reach the grey area, the workspace: {survey.measures.workspace_area:.0f} cm²",
        _tall(survey, 4, width) + 1.6,
        width,
    )
    panels = figure.subplots(1, 4, sharey=True)
    titles = (
        "the same motor angles\nin both assembly modes",
        "Type 1: a leg is stretched\nor folded",
        "Type 2: distal links aligned,\nfree to move along the arrow",
        "Type 3: both at once,\nin all working modes",
    )
    grid = survey.fields.platform_grid
    for axes, title in zip(panels, titles, strict=True):
        drawing.platform_field(axes, survey.fields, np.ones_like(grid.reach), drawing.PLAIN, 0.0, 1.0)
        axes.set_title(title, fontsize=10)
    examples = survey.examples
    for state in (examples.counterpart, examples.regular[WORKING_MODES[0]]):
        _robot(panels[0], survey, state, ASSEMBLY_COLORS[assembly_mode(state)])
    drawing.platform_type1(panels[1], survey.loci)
    drawing.platform_type2(panels[2], survey.loci, WORKING_MODES[0])
    drawing.platform_type3(panels[3], survey.loci)
    singular = ((examples.type1, INK), (examples.type2, PURPLE), (examples.type3, INK))
    for axes, (example, color) in zip(panels[1:], singular, strict=True):
        if example is None:
            axes.text(0.5, 0.94, "this robot has none", transform=axes.transAxes, ha="center", color=GREY)
        else:
            _robot(axes, survey, example, color)
    if examples.type2 is not None:
        svd = parallel_svd(examples.type2)
        _double_arrow(panels[2], examples.type2, svd.t_x, svd.t_y)
    for axes in panels:
        _finish_plane(axes, survey)
        axes.label_outer()
    return figure


def assembly_modes(survey: Survey) -> Figure:
    """Draw both assembly modes' regions and all loci in each working mode."""
    figure = new_figure(
        "Assembly modes and singularities, by working mode",
        f"{survey.name}: working mode: side of each elbow, +1 to the left on the way from motor to platform",
        2.0 * _tall(survey, 2, WIDTH) + 3.6,
    )
    grid = survey.fields.platform_grid
    for axes, mode in zip(figure.subplots(2, 2).flat, survey.measures.modes, strict=True):
        det = survey.fields.platform[mode.working_mode].det_a
        drawing.platform_field(axes, survey.fields, det, drawing.ASSEMBLIES, -1e-9, 1e-9)
        _loci(axes, survey, mode.working_mode)
        state = survey.examples.regular[mode.working_mode]
        _robot(axes, survey, state, INK)
        busy = _occupied(survey, state)
        busy += [(MM * point.x, MM * point.y) for point in survey.loci.type3]
        for sign, text in ((1.0, "det A > 0"), (-1.0, "det A < 0")):
            place = drawing.name_region(axes, text, MM * grid.x, MM * grid.y, sign * det > 0.0, busy)
            busy += [place] if place is not None else []
        axes.set_title(
            f"working mode {working_mode_label(mode.working_mode)}\n"
            f"{mode.area_positive:.0f} cm² with det A > 0, {mode.area_negative:.0f} cm² with det A < 0",
        )
        _finish_plane(axes, survey)
        drawing.name_curves(axes, survey.loci, mode.working_mode)
    keys = [*drawing.assembly_keys(), drawing.type3_key(), *drawing.type2_keys(), *drawing.type1_keys()]
    legend_below(figure, keys, columns=3)
    return figure


def conditioning(survey: Survey) -> Figure:
    """Draw 1/cond(A) in each working mode."""
    figure = new_figure(
        "Conditioning 1/cond(A), by working mode",
        f"{survey.name}: 0 on the locus, 1 where the distal links are at right angles",
        2.0 * _tall(survey, 2, WIDTH) + 3.8,
    )
    panels = figure.subplots(2, 2)
    for axes, modes in zip(panels.flat, WORKING_MODES, strict=True):
        kappa = survey.fields.platform[modes].kappa
        image = drawing.platform_field(axes, survey.fields, kappa, drawing.KAPPA, 0.0, 1.0)
        _loci(axes, survey, modes, cased=True)
        _robot(axes, survey, survey.examples.regular[modes], INK, cased=True)
        axes.set_title(f"working mode {working_mode_label(modes)}")
        _finish_plane(axes, survey)
    figure.colorbar(image, ax=panels, location="bottom", shrink=0.6, aspect=40, pad=0.02, label="1/cond(A)")
    keys = [*drawing.type2_keys(), *drawing.type1_keys(), drawing.type3_key()]
    legend_below(figure, keys, columns=3)
    return figure


def motor_modes(survey: Survey) -> Figure:
    """Draw where the loop closes over the motor angles, and the working modes, in each assembly mode."""
    figure = new_figure(
        "The plane of the motor angles, by assembly mode",
        f"{survey.name}: the loop closes for {100.0 * survey.measures.closing_share:.0f} % of all pairs of angles;"
        " where it is pale grey, the distal links do not meet",
        7.3,
        11.5,
    )
    degrees = np.degrees(survey.fields.motor_grid.q)
    for axes, assembly in zip(figure.subplots(1, 2), ASSEMBLY_MODES, strict=True):
        field = survey.fields.motors[assembly].working_mode
        drawing.motor_field(axes, survey.fields, field, drawing.MODES, -0.5, 3.5)
        drawing.motor_loci(axes, survey.loci, assembly)
        drawn = [
            np.degrees([state.leg1.q1, state.leg2.q1])
            for state in survey.examples.regular.values()
            if assembly_mode(state) == assembly
        ]
        axes.plot([q[0] for q in drawn], [q[1] for q in drawn], **POSTURE_MARKER, zorder=5.6, clip_on=False)
        for index, modes in enumerate(WORKING_MODES):
            busy = [(float(q[0]), float(q[1])) for q in drawn]
            drawing.name_region(axes, working_mode_label(modes), degrees, degrees, field == index, busy)
        axes.set_title(assembly_mode_label(assembly))
        drawing.motor_frame(axes)
    keys = [*drawing.mode_keys(), *drawing.leg_keys(), *drawing.type2_keys(), drawing.type3_key()]
    keys.append(Line2D([], [], **POSTURE_MARKER, label="robot as drawn for its working mode"))
    legend_below(figure, keys, columns=3)
    return figure


def motor_conditioning(survey: Survey) -> Figure:
    """Draw 1/cond(A) over the motor angles, in each assembly mode."""
    figure = new_figure(
        "Conditioning 1/cond(A) over the motor angles, by assembly mode",
        f"{survey.name}: the two sheets are joined along the Type 2 locus, where 1/cond(A) is 0",
        7.6,
        11.5,
    )
    panels = figure.subplots(1, 2)
    for axes, assembly in zip(panels, ASSEMBLY_MODES, strict=True):
        kappa = survey.fields.motors[assembly].kappa
        image = drawing.motor_field(axes, survey.fields, kappa, drawing.KAPPA, 0.0, 1.0)
        drawing.motor_loci(axes, survey.loci, assembly, cased=True)
        axes.set_title(assembly_mode_label(assembly))
        drawing.motor_frame(axes)
    figure.colorbar(image, ax=panels, location="bottom", shrink=0.6, aspect=40, label="1/cond(A)")
    keys = [*drawing.leg_keys(), *drawing.type2_keys(), drawing.type3_key()]
    legend_below(figure, keys, columns=4)
    return figure


def _tall(survey: Survey, across: int, width: float) -> float:
    """Return how high (inches) a panel of the platform's plane is, one of so many beside each other."""
    left, right, half = drawing.platform_limits(survey.robot, survey.fields)
    return 2.0 * half / (right - left) * ((width - 0.7) / across - (0.65 if across < 3 else 0.15))


def _loci(axes: Axes, survey: Survey, modes: tuple[int, int], cased: bool = False) -> None:
    drawing.platform_type1(axes, survey.loci)
    drawing.platform_type2(axes, survey.loci, modes, cased)
    drawing.platform_type3(axes, survey.loci, modes)


def _robot(axes: Axes, survey: Survey, state: State, color: str, cased: bool = False) -> None:
    motors, place = (state.leg1.q1, state.leg2.q1), (state.x, state.y)
    if cased:
        draw_robot(axes, survey.robot, motors, place, "white", width=5.4, zorder=2.8)
    draw_robot(axes, survey.robot, motors, place, color, width=3.2)


def _double_arrow(axes: Axes, state: State, along_x: float, along_y: float) -> None:
    """Draw in which direction (unit vector) the platform moves freely."""
    for side in (1.0, -1.0):
        end = (MM * state.x + side * ARROW * along_x, MM * state.y + side * ARROW * along_y)
        axes.annotate(
            "",
            end,
            (MM * state.x, MM * state.y),
            arrowprops={"arrowstyle": "-|>", "color": VERMILION, "linewidth": 2.2, "shrinkA": 6, "shrinkB": 0},
            zorder=2.9,
        )


def _occupied(survey: Survey, state: State) -> list[tuple[float, float]]:
    """Return places (mm) along the links and at the motors with their names, for texts to keep off."""
    places: list[tuple[float, float]] = []
    for leg, parameters in ((state.leg1, survey.robot.leg1), (state.leg2, survey.robot.leg2)):
        base = np.array([parameters.base_x, 0.0])
        elbow = base + parameters.proximal * np.array([leg.r_x, leg.r_y])
        places += _between(base, elbow) + _between(elbow, np.array([state.x, state.y]))
        places.append((MM * parameters.base_x, -25.0))
    return places


def _between(start: FloatArray, end: FloatArray) -> list[tuple[float, float]]:
    marks = MM * (start + np.linspace(0.0, 1.0, 6)[:, None] * (end - start))
    return [(float(x), float(y)) for x, y in marks]


def _finish_plane(axes: Axes, survey: Survey) -> None:
    draw_base(axes, survey.robot)
    drawing.outline_texts(axes)
    drawing.platform_frame(axes, survey.robot, survey.fields)
