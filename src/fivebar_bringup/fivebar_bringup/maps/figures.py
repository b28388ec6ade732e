"""The figures of a map."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fivebar_bringup.maps.drawing import (
    ASSEMBLY,
    KAPPA,
    MM,
    MODE_COLORS,
    PLAIN,
    assembly_keys,
    leg_keys,
    locus_keys,
    mode_keys,
    mode_name,
    motor_field,
    motor_frame,
    motor_loci,
    name_region,
    outline_texts,
    platform_field,
    platform_frame,
    platform_loci,
    type1_keys,
    type3_key,
)
from fivebar_bringup.maps.examples import Example, Examples
from fivebar_bringup.maps.fields import ASSEMBLY_MODES, WORKING_MODES, Fields
from fivebar_bringup.maps.loci import Loci
from fivebar_bringup.maps.measures import Measures
from fivebar_bringup.report.style import BLUE, GREY, INK, PURPLE, VERMILION, new_figure
from fivebar_bringup.report.workspace import draw_base, draw_robot
from fivebar_description.parameters import FiveBar


class Survey(NamedTuple):
    """All that is known of a robot's geometry."""

    name: str
    robot: FiveBar
    loci: Loci
    fields: Fields
    measures: Measures
    examples: Examples


def singular_postures(survey: Survey) -> Figure:
    """Draw the robot in both assembly modes, and in a singular posture of each type."""
    figure = new_figure(
        "The robot and its three kinds of singular posture",
        f"{survey.name}: the grey area is the workspace, where both legs reach; {survey.measures.workspace_area:.0f} cm²",
        5.2,
        13.0,
    )
    examples = survey.examples
    first = examples.regular[WORKING_MODES[0]]
    panels = figure.subplots(1, 4, sharey=True)
    titles = (
        "same motor angles, both assembly modes",
        "Type 1: a leg stretched",
        "Type 2: distal links aligned",
        "Type 3: both at once",
    )
    for axes, title in zip(panels, titles, strict=True):
        platform_field(axes, survey.fields, np.ones_like(survey.fields.platform_grid.reach), PLAIN, 0.0, 1.0)
        axes.set_title(title, fontsize=10)
    _robot(panels[0], survey, examples.counterpart, VERMILION if examples.assembly[WORKING_MODES[0]] > 0 else BLUE)
    _robot(panels[0], survey, first, BLUE if examples.assembly[WORKING_MODES[0]] > 0 else VERMILION)
    for axes, example, color in zip(
        panels[1:], (examples.type1, examples.type2, examples.type3), (INK, PURPLE, INK), strict=True
    ):
        if example is None:
            axes.text(0.5, 0.9, "this robot has none", transform=axes.transAxes, ha="center", color=GREY)
        else:
            _robot(axes, survey, example, color)
    for axes in panels:
        _finish_plane(axes, survey)
    for axes in panels[1:]:
        axes.set_ylabel("")
    return figure


def assembly_modes(survey: Survey) -> Figure:
    """Draw both assembly modes' regions and all loci in each working mode."""
    figure = new_figure(
        "Assembly modes and singularities, by working mode",
        f"{survey.name}: the signs name the side of each elbow; +1 lies to the left on the way from motor to platform",
        13.4,
    )
    grid = survey.fields.platform_grid
    for axes, mode in zip(figure.subplots(2, 2).flat, survey.measures.modes, strict=True):
        field = survey.fields.platform[mode.working_mode]
        platform_field(axes, survey.fields, field.det_a, ASSEMBLY, -1e-9, 1e-9)
        platform_loci(axes, survey.loci, mode.working_mode)
        example = survey.examples.regular[mode.working_mode]
        _robot(axes, survey, example, INK)
        place = (MM * example.place[0], MM * example.place[1])
        for sign, text in ((1.0, "det A > 0"), (-1.0, "det A < 0")):
            name_region(axes, text, MM * grid.x, MM * grid.y, sign * field.det_a > 0.0, [place])
        axes.set_title(
            f"working mode {mode_name(mode.working_mode)}\n"
            f"{mode.area_positive:.0f} cm² det A > 0, {mode.area_negative:.0f} cm² det A < 0",
        )
        _finish_plane(axes, survey)
    keys = [*assembly_keys(), *locus_keys(), *type1_keys(), type3_key()]
    figure.legend(handles=keys, loc="outside lower center", ncols=3)
    return figure


def conditioning(survey: Survey) -> Figure:
    """Draw 1/cond(A) in each working mode."""
    figure = new_figure(
        "How far from Type 2: 1/cond(A), by working mode",
        f"{survey.name}: 0 on the locus, 1 where the distal links are at right angles",
        13.4,
    )
    panels = figure.subplots(2, 2)
    for axes, modes in zip(panels.flat, WORKING_MODES, strict=True):
        image = platform_field(axes, survey.fields, survey.fields.platform[modes].kappa, KAPPA, 0.0, 1.0)
        platform_loci(axes, survey.loci, modes, "white")
        _robot(axes, survey, survey.examples.regular[modes], INK)
        axes.set_title(f"working mode {mode_name(modes)}")
        _finish_plane(axes, survey)
    figure.colorbar(image, ax=panels, location="bottom", shrink=0.6, aspect=40, pad=0.02, label="1/cond(A)")
    return figure


def motor_modes(survey: Survey) -> Figure:
    """Draw where the loop closes over the motor angles, and the working modes, in each assembly mode."""
    figure = new_figure(
        "The plane of the motor angles, by assembly mode",
        f"{survey.name}: the loop closes for {100.0 * survey.measures.closing_share:.0f} % of all pairs of motor angles;"
        " the pale grey rest is out of reach",
        7.4,
        11.5,
    )
    degrees = np.degrees(survey.fields.motor_grid.q)
    for axes, assembly in zip(figure.subplots(1, 2), ASSEMBLY_MODES, strict=True):
        field = survey.fields.motors[assembly]
        motor_field(axes, survey.fields, field.working_mode, MODE_COLORS, -0.5, 3.5)
        motor_loci(axes, survey.loci, assembly)
        for index, modes in enumerate(WORKING_MODES):
            name_region(axes, mode_name(modes), degrees, degrees, field.working_mode == index)
        axes.set_title(f"assembly mode det A {'>' if assembly > 0 else '<'} 0")
        motor_frame(axes)
    keys = [*mode_keys(), *locus_keys(), *leg_keys(), type3_key()]
    figure.legend(handles=keys, loc="outside lower center", ncols=4)
    return figure


def motor_conditioning(survey: Survey) -> Figure:
    """Draw 1/cond(A) over the motor angles, in each assembly mode."""
    figure = new_figure(
        "How far from Type 2 over the motor angles: 1/cond(A), by assembly mode",
        f"{survey.name}: both assembly modes meet in the locus, where 1/cond(A) is 0",
        6.9,
        11.5,
    )
    panels = figure.subplots(1, 2)
    for axes, assembly in zip(panels, ASSEMBLY_MODES, strict=True):
        image = motor_field(axes, survey.fields, survey.fields.motors[assembly].kappa, KAPPA, 0.0, 1.0)
        motor_loci(axes, survey.loci, assembly)
        axes.set_title(f"assembly mode det A {'>' if assembly > 0 else '<'} 0")
        motor_frame(axes)
    figure.colorbar(image, ax=panels, location="bottom", shrink=0.6, aspect=40, label="1/cond(A)")
    return figure


def _robot(axes: Axes, survey: Survey, example: Example, color: str) -> None:
    draw_robot(axes, survey.robot, example.motors, example.place, color, width=3.2)


def _finish_plane(axes: Axes, survey: Survey) -> None:
    draw_base(axes, survey.robot)
    outline_texts(axes)
    platform_frame(axes, survey.robot, survey.fields)
