"""From a robot's parameter file to the map of its workspace and singularities."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from fivebar_bringup.pages.picture import write_pictures
from fivebar_bringup.runs.bag.tail import replace_file
from fivebar_bringup.runs.run_directory import new_directory
from fivebar_description.parameters import FiveBar, RobotFile, read_robot
from fivebar_description.strict_yaml import InputError

CELLS = 200
"""Cells along the longer side of a plane; areas are good to about 0.01 %."""


class MapDirectory(NamedTuple):
    """The directory of one map; every file in it has its place here."""

    path: Path

    @property
    def page(self) -> Path:
        """The page to look at."""
        return self.path / "map.html"

    @property
    def measures(self) -> Path:
        """Areas, lengths, Type 3 points."""
        return self.path / "map.json"

    @property
    def figures(self) -> Path:
        """The folder of the PNG figures."""
        return self.path / "figures"


def read_mappable_robot(robot: str) -> RobotFile:
    """Read a robot by name or parameter file.

    Raises:
        InputError: the file does not describe a five-bar, or its legs never meet.
    """
    file = read_robot(robot)
    _check_that_legs_meet(file.five_bar(), robot)
    return file


def new_map_directory(out: Path | None, name: str) -> MapDirectory:
    """Make the directory of a new map.

    Raises:
        InputError: the directory holds something already or cannot be made.
    """
    return MapDirectory(new_directory(out, f"map-{name}"))


def make_map(
    file: RobotFile, directory: MapDirectory, progress: Callable[[int, int], None], cells: int = CELLS
) -> dict[str, Any]:
    """Map a robot, write page, figures and measures into its directory, and return the measures.

    Raises:
        InputError: the directory cannot be written to.
    """
    five_bar = file.five_bar()
    # here, because matplotlib and scipy take as long to load as all the rest of the command
    from fivebar_bringup.studies.map.examples import choose
    from fivebar_bringup.studies.map.figures import Survey
    from fivebar_bringup.studies.map.gallery import PICTURES, draw_pictures
    from fivebar_bringup.studies.map.measures import measure
    from fivebar_bringup.studies.map.page import html_page
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
    try:
        write_pictures(directory.figures, pictures)
        replace_file(directory.page, html_page(file.name, five_bar, measures, pictures).encode("utf-8"))
        replace_file(directory.measures, (json.dumps(content, indent=2, allow_nan=False) + "\n").encode("utf-8"))
    except OSError as error:
        raise InputError(f"{directory.path}: the map cannot be written: {error.strerror}") from error
    return content


def _check_that_legs_meet(robot: FiveBar, source: str) -> None:
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
