"""Subcommand that finds a robot's parameters from a recording: identify."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console
from rich.table import Table

from fivebar_bringup.cli.app import JsonOption, app, ending_on_sigterm, input_errors
from fivebar_bringup.studies.identify.identify import ROBOT_FILE, identify_bag, write_identification
from fivebar_bringup.studies.identify.result import INTERVALS, IdentificationResult


@app.command()
def identify(
    bag: Annotated[Path, typer.Argument(metavar="BAG", help="A bag, or the directory of a run.")],
    robot: Annotated[
        str | None,
        typer.Option(
            "--robot",
            help="Robot or parameter file (.yaml) with the lengths of the robot [default: that of the run]",
        ),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="New or empty directory for the results [default: runs/identify-ROBOT-DATE-TIME]"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Identify inertias, mass and friction of the robot in BAG, and write them as a parameter file.

    A motion that excites all of them is the scenario excitation; docs/identification.md goes through it.

    Example: `fivebar identify runs/moved`, of a run made by `fivebar simulate excitation --out runs/moved`
    """
    with input_errors(), ending_on_sigterm():
        findings = identify_bag(bag, robot)
        directory = write_identification(findings, out)
    if as_json:
        print(json.dumps(findings.as_json(), indent=2, allow_nan=False))
        return
    printer = Console()
    printer.print(_table(findings))
    cutoffs, fit = findings.found.cutoffs, findings.found.fit
    printer.print(
        f"condition number {fit.condition:.3g}; {findings.encoder()}: derivatives cut off at"
        f" {cutoffs.derivative_hz:.3g} Hz, equations at {cutoffs.parallel_hz:.3g} Hz",
        soft_wrap=True,
    )
    printer.print(f"parameter file {directory.path / ROBOT_FILE}, look at {directory.page}", soft_wrap=True)


def _table(findings: IdentificationResult) -> Table:
    table = Table("parameter", "before", f"identified, {INTERVALS}", "unit", "change", box=None)
    for one in findings.parameters():
        table.add_row(one.name, f"{one.before:g}", one.text(), one.unit, one.change())
    return table
