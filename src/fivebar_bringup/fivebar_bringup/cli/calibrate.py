# SPDX-License-Identifier: Apache-2.0
"""Subcommand that finds a robot's geometry from a recording: calibrate."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from fivebar_bringup.cli.app import Group, JsonOption, RecordedNamespaceOption, command, input_errors
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_bringup.runs.namespace import read_namespace
from fivebar_description.interrupts import keyboard_interrupts

if TYPE_CHECKING:
    from fivebar_bringup.calibrate.result import CalibrationResult


@command(Group.ROBOT)
def calibrate(
    bags: Annotated[
        list[Path], typer.Argument(metavar="BAG...", help="Bags, or directories of runs, all of the same robot.")
    ],
    robot: Annotated[
        str | None,
        typer.Option("--robot", help="Robot to start from, by name or file (.yaml) [default: that of the run]"),
    ] = None,
    touched: Annotated[
        Path | None,
        typer.Option(
            "--touched", help="File (.yaml) of places of the platform, measured with the first bag: the scale."
        ),
    ] = None,
    encoders_only: Annotated[
        bool,
        typer.Option("--encoders-only", help="Use no gyroscope: the elbow gap from the motors' turning points alone."),
    ] = False,
    camera: Annotated[
        bool,
        typer.Option(
            "--camera/--no-camera", help="Use the platform by the camera, where the bag has it; it shows the scale."
        ),
    ] = True,
    drives: Annotated[
        str | None,
        typer.Option("--drives", help="Configuration of the drives, to be written with the corrected encoder zeros."),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="New or empty directory for the results [default: runs/calibrate-ROBOT-DATE-TIME]"),
    ] = None,
    namespace: RecordedNamespaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Find lengths, encoder zeros and IMU from recorded runs.

    The results are written as a robot file. The motion must go through the Type 2 locus and back, as the scenario
    calibration does; docs/calibration.md goes through it, and through calibrating by hand without power.

    Example: `fivebar calibrate runs/moved`, of a run made by `fivebar simulate calibration --out runs/moved`
    """
    from fivebar_bringup.calibrate.calibrate import DRIVES_FILE, ROBOT_FILE, calibrate_bag, write_calibration
    from fivebar_bringup.calibrate.page import quality_rows

    with input_errors(), keyboard_interrupts():
        within = None if namespace is None else read_namespace(namespace)
        with progress_bar("calibration", as_json):
            result = calibrate_bag(bags[0], robot, touched, encoders_only, camera, None, within)
            for bag in bags[1:]:
                result = calibrate_bag(bag, robot, None, encoders_only, camera, result, within)
            directory = write_calibration(result, out, drives)
    if as_json:
        print(json.dumps(result.as_json(), indent=2, allow_nan=False))
        return
    printer = Printer()
    printer.print(_table(result))
    for quantity, value in (*quality_rows(result), *result.mounting_rows()):
        printer.print(f"{quantity}: {value}", soft_wrap=True)
    for direction in result.unseen:
        printer.print(f"not seen, stays as it was: {direction.words}", soft_wrap=True)
    zero_1, zero_2 = result.zeros()
    place = f"in {directory.path / DRIVES_FILE}" if drives is not None else f"{-zero_1:+.6f} and {-zero_2:+.6f} rad"
    printer.print(f"correction of home_offset_rad of q11 and q21: {place}", soft_wrap=True)
    printer.print(f"robot file {directory.path / ROBOT_FILE}, look at {directory.page}", soft_wrap=True)


def _table(result: CalibrationResult) -> Table:
    from fivebar_bringup.calibrate.result import INTERVALS

    table = Table("parameter", "before", f"calibrated, {INTERVALS}", "unit", box=None)
    for parameter in result.parameters():
        table.add_row(parameter.name, f"{parameter.before:g}", parameter.text(), parameter.unit)
    return table
