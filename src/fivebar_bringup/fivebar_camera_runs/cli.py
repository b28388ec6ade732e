# SPDX-License-Identifier: Apache-2.0
"""Subcommand that calibrates a camera: camera-calibrate."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from fivebar_bringup.cli.app import Group, JsonOption, command, input_errors
from fivebar_bringup.cli.printing import say
from fivebar_bringup.cli.progress import progress_bar


@command(Group.ROBOT, "camera-calibrate", idle={"--board": ("--simulate", "--views", "--out", "--json")})
def camera_calibrate(
    pictures: Annotated[
        list[Path] | None,
        typer.Argument(metavar="[PICTURES]...", help="Pictures (PNG) of the board, or directories of them."),
    ] = None,
    columns: Annotated[int, typer.Option("--columns", help="Squares in a row of the board.", min=3, max=40)] = 11,
    rows: Annotated[int, typer.Option("--rows", help="Rows of the board.", min=3, max=40)] = 8,
    square: Annotated[float, typer.Option("--square", help="Edge of a square, m.", min=1e-3, max=1.0)] = 0.025,
    board: Annotated[
        Path | None, typer.Option("--board", help="Write the board to this file (PNG), to be printed, and end.")
    ] = None,
    simulate: Annotated[
        str | None,
        typer.Option("--simulate", metavar="SCENARIO", help="Calibrate the simulated camera of a scenario instead."),
    ] = None,
    views: Annotated[int, typer.Option("--views", help="Pictures of the simulated camera.", min=6, max=200)] = 16,
    out: Annotated[Path, typer.Option("--out", help="File for the calibration.")] = Path("camera.yaml"),
    as_json: JsonOption = False,
) -> None:
    """Find the lens of a camera from pictures of a board.

    The result is a camera_info file. The ChArUco board is to be seen from different sides and in all corners of the
    picture; docs/estimation.md says how.

    Example: `fivebar camera-calibrate --board board.png`, print it, then `fivebar camera-calibrate pictures/`
    """
    from fivebar_camera_runs.camera_calibration import Board, calibrate_files, calibrate_simulated, write_board

    with input_errors():
        pattern = Board(columns, rows, square)
        if board is not None:
            write_board(pattern, board)
            say(f"board {board}: {columns * square * 1e3:g} x {rows * square * 1e3:g} mm")
            return
        with progress_bar("calibration", as_json):
            found = (
                calibrate_files(pattern, pictures or [])
                if simulate is None
                else calibrate_simulated(pattern, simulate, views)
            )
        found.write(out)
    if as_json:
        print(json.dumps(found.as_json(), indent=2, allow_nan=False))
        return
    o = found.optics
    print(f"{found.pictures} pictures with the board, corners within {found.deviation:.3f} px (root mean square)")
    print(f"focal length {o.fx:.2f}, {o.fy:.2f} px, principal point {o.cx:.2f}, {o.cy:.2f} px")
    say(f"written to {out}")
