# SPDX-License-Identifier: Apache-2.0
"""Subcommand that estimates a recorded motion again: estimate."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from fivebar_bringup.cli.app import Group, JsonOption, RecordedNamespaceOption, command, input_errors
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_bringup.runs.namespace import read_namespace
from fivebar_description.interrupts import keyboard_interrupts


@command(Group.ROBOT)
def estimate(
    bag: Annotated[Path, typer.Argument(metavar="BAG", help="A bag, or the directory of a run, with estimator ekf.")],
    settings: Annotated[
        list[str] | None,
        typer.Option("--set", metavar="KEY=VALUE", help="A setting of ekf or tolerances to change; may be repeated."),
    ] = None,
    file: Annotated[
        Path | None,
        typer.Option("--settings", help="YAML file with sections ekf and tolerances, or a whole scenario."),
    ] = None,
    scenario: Annotated[
        Path | None, typer.Option("--scenario", help="Scenario (.yaml) of a bag that lies in no run's directory.")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="New or empty directory for the results, or that of the same comparison"
            " [default: runs/estimate-NAME-DATE-TIME]",
        ),
    ] = None,
    namespace: RecordedNamespaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Repeat a run's state estimation with other settings.

    The estimator computes the platform from the encoders, and the IMU where there is one. The page shows how consistent
    its estimates are. Without any change the result equals the recorded estimate bit for bit where the run was
    simulated.

    Example: `fivebar estimate runs/first --set ekf.gyro_noise=0.02 --set tolerances.length=1e-4`
    """
    from fivebar_bringup.recorded.results import new_directory
    from fivebar_studies.engine.running import run_study
    from fivebar_studies.estimate.study import ESTIMATION, compared

    with input_errors(), keyboard_interrupts():
        arguments = {
            "bag": str(bag),
            "changes": tuple(settings or ()),
            "file": None if file is None else str(file),
            "scenario": None if scenario is None else str(scenario),
            "namespace": None if namespace is None else read_namespace(namespace),
        }
        with progress_bar("estimation", as_json):
            estimation = compared(ESTIMATION.settings_with(arguments))
            directory = out or new_directory(None, f"estimate-{estimation.recorded.name}")
            finished = run_study(ESTIMATION, arguments, directory)
    if as_json:
        print(json.dumps(finished.content, indent=2, allow_nan=False))
        return
    printer = Printer()
    for name, was, now in estimation.changes():
        printer.print(f"{name}: {was} -> {now}", soft_wrap=True)
    table = Table("figure", "recorded settings", "changed settings", box=None)
    for row in estimation.rows():
        table.add_row(*row)
    printer.print(table)
    printer.print(f"look at {finished.page}", soft_wrap=True)
