"""Subcommand that draws the slides of a lecture."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from fivebar_bringup.cli.app import Group, command, input_errors
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar


@command(Group.STUDY)
def lecture(
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where to write the figures.")] = Path(
        "runs/lecture"
    ),
) -> None:
    """Draw six slides on crossing singularities, as SVG.

    They go with the notebook `docs/tutorials/lecture.ipynb`, which has the exercises.

    Example: `fivebar lecture --out slides`
    """
    from fivebar_bringup.recorded.results import write_errors
    from fivebar_bringup.studies.lecture_slides import draw_slides

    with input_errors(), write_errors(out), progress_bar("slides") as progress:
        paths = draw_slides(out, progress)
    Printer().print("\n".join(f"look at {path}" for path in paths), soft_wrap=True)
