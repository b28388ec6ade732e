# SPDX-License-Identifier: Apache-2.0
"""Six slides of a lecture on crossing singularities, as SVG: figures of the map and of two runs.

`python docs/studies/lecture_slides.py [FOLDER]` draws them; they go with docs/tutorials/lecture.ipynb.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

from matplotlib.figure import Figure

from fivebar_bringup.map import figures as of_map
from fivebar_bringup.map.examples import choose
from fivebar_bringup.map.measures import measure
from fivebar_bringup.pages.style import house_style, svg
from fivebar_bringup.recorded.results import write_results
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.report.analysis import RunAnalysis
from fivebar_bringup.report.gallery import DRAW
from fivebar_bringup.report.report import read_analysis
from fivebar_bringup.runs.offline import run_offline
from fivebar_bringup.scenario import Scenario
from fivebar_control.workspace.fields import evaluate
from fivebar_control.workspace.loci import singular_loci
from fivebar_description.robot_file import read_robot

CELLS = 120
"""Cells along the longer side of the planes that are drawn."""

LONGER = 2e-4
"""Excess of distal link 1 (m) over the length that the controllers know, so that a law which inverts the dynamics
gets lost."""

SLIDES = (
    "1_singular_postures",
    "2_assembly_modes",
    "3_conditioning",
    "4_computed_torque_fails",
    "5_criterion",
    "6_across",
)
"""Their names, in the order of the lecture."""


def draw_slides(folder: Path) -> list[Path]:
    """Draw the slides into a folder, and return their files.

    Raises:
        InputError: a file cannot be written.
        OSError: the folder cannot be made.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    with house_style():
        for name, figure in zip(SLIDES, _figures(), strict=True):
            write_results(folder, {f"{name}.svg": svg(figure)})
            paths.append(folder / f"{name}.svg")
    return paths


def _figures() -> Iterator[Figure]:
    file = read_robot("dextar")
    robot = file.five_bar()
    loci = singular_loci(robot)
    fields = evaluate(robot, loci, CELLS, lambda done, total: None)
    survey = of_map.Survey(file.name, robot, loci, fields, measure(loci, fields), choose(robot, loci, fields))
    yield of_map.postures(survey)
    yield of_map.assembly_modes(survey)
    yield of_map.conditioning(survey)
    yield DRAW["torques"](run_with("ctc"))
    across = run_with("unified")
    yield DRAW["criterion"](across)
    yield DRAW["hero"](across)


def run_with(controller: str) -> RunAnalysis:
    """Return the middle crossing of a controller on a robot with a wrong length."""
    scenario = Scenario.model_validate(
        {
            "name": f"lecture_{controller}",
            "controller": controller,
            "waypoints": [[0.0, 0.15], [0.0, 0.02]],
            "plant": {"torque_limit": 10.0, "links": {"l_12": LONGER}},
            "force": True,
        }
    )
    with TemporaryDirectory() as folder:
        directory, _ = run_offline(scenario, Path(folder, "run"), lambda done, total: None, with_page=False)
        return read_analysis(RunDirectory(directory.path))


def main() -> None:
    """Draw the slides, and say where they are."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path, nargs="?", default=Path("runs/lecture"), help="where they are written")
    folder = parser.parse_args().folder
    print("\n".join(f"look at {path}" for path in draw_slides(folder)))


if __name__ == "__main__":
    main()
