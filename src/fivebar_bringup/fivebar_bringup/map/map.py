# SPDX-License-Identifier: Apache-2.0
"""Maps the workspace and the singularities of a robot given by its file."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from fivebar_bringup.pages.study_directory import StudyDirectory
from fivebar_description.parameters import FiveBar
from fivebar_description.robot_file import RobotFile, read_robot
from fivebar_description.strict_yaml import InputError

CELLS = 200
"""Cells along the longer side of a plane; areas are good to about 0.01 %."""


def read_mappable_robot(robot: str) -> RobotFile:
    """Read a robot by name or file.

    Raises:
        InputError: the file does not describe a five-bar, or its legs never meet.
    """
    file = read_robot(robot)
    check_that_legs_meet(file.five_bar(), robot)
    return file


def make_map(
    file: RobotFile, directory: StudyDirectory, progress: Callable[[int, int], None], cells: int = CELLS
) -> dict[str, Any]:
    """Map a robot, write page, figures and measures into its directory, and return the measures.

    Raises:
        InputError: the directory cannot be written to.
    """
    five_bar = file.five_bar()
    # here, because matplotlib and scipy take as long to load as all the rest of the command
    from fivebar_bringup.map.examples import choose
    from fivebar_bringup.map.figures import Survey
    from fivebar_bringup.map.measures import measure
    from fivebar_bringup.map.page import PICTURES, draw_pictures, html_page
    from fivebar_control.workspace.fields import evaluate
    from fivebar_control.workspace.loci import singular_loci

    # a picture takes about as long as this many rows
    rows_per_picture = cells // 8
    drawing = rows_per_picture * len(PICTURES)
    loci = singular_loci(five_bar)
    fields = evaluate(five_bar, loci, cells, lambda done, total: progress(done, total + drawing))
    measures = measure(loci, fields)
    survey = Survey(file.name, five_bar, loci, fields, measures, choose(five_bar, loci, fields))
    rows = len(fields.platform_grid.y) + cells
    pictures = []
    for number, picture in enumerate(draw_pictures(survey), start=1):
        pictures.append(picture)
        progress(rows + number * rows_per_picture, rows + drawing)
    content = {"robot": file.name, "lengths_m": file.lengths_m.model_dump(), **measures.as_json()}
    directory.write(html_page(file.name, five_bar, measures, pictures), content, pictures)
    return content


def check_that_legs_meet(robot: FiveBar, source: str) -> None:
    """Refuse a robot whose legs reach no place in common: its rings lie side by side or one in the other's hole."""
    apart = robot.leg2.base_x - robot.leg1.base_x
    reach = [leg.proximal + leg.distal for leg in (robot.leg1, robot.leg2)]
    hole = [abs(leg.proximal - leg.distal) for leg in (robot.leg1, robot.leg2)]
    if apart >= sum(reach):
        raise InputError(f"{source}: lengths_m.a: {apart:g}: expected less than {sum(reach):g}, the reach of both legs")
    for own, other in ((0, 1), (1, 0)):
        if apart + reach[own] <= hole[other]:
            raise InputError(
                f"{source}: lengths_m: the legs never meet: leg {own + 1} stays within {apart + reach[own]:g} m of"
                f" motor {other + 1}, and leg {other + 1} gets no closer to it than {hole[other]:g} m"
            )
