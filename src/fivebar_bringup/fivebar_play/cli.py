# SPDX-License-Identifier: Apache-2.0
"""Subcommand that writes the page which explains by play."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Annotated

import typer

from fivebar_bringup.cli.app import Group, command, input_errors
from fivebar_bringup.cli.printing import Printer


@command(Group.RUN)
def play(
    out: Annotated[Path, typer.Option("--out", metavar="FILE", help="Where to write the page.")] = Path(
        "runs/play.html"
    ),
    opened: Annotated[
        bool, typer.Option("--open/--no-open", help="Open the page in the browser, where there is a screen.")
    ] = True,
) -> None:
    """Play with a singularity in the browser, without ROS.

    It writes one page that needs no network: drag the robot to where it loses its grip, cross with one controller after
    the other, and see what each asks of the motors.

    Example: `fivebar play`
    """
    from fivebar_bringup.recorded.results import write_errors
    from fivebar_description.files import write_file
    from fivebar_play.page import page

    with input_errors():
        with write_errors(out.parent):
            out.parent.mkdir(parents=True, exist_ok=True)
        write_file(out, page())
    Printer().print(f"look at {out}", soft_wrap=True)
    if opened and (os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY")):
        import webbrowser

        webbrowser.open(out.resolve().as_uri())
