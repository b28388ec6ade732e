"""Subcommand that runs thousands of random crossings: sweep."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table
from rich.text import Text

from fivebar_bringup.cli.app import Group, JobsOption, JsonOption, command, input_errors, processes_of
from fivebar_bringup.cli.compare import chosen
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts

QUICK_CASES = 60

SHOWN = {
    "controller": "controller",
    "status": "status",
    "success": "success",
    "error_peak": "peak, m",
    "error_final": "final, m",
}
"""Columns of a single case on the terminal; the reasons come below."""


@command(Group.STUDY)
def sweep(
    cases: Annotated[
        int | None,
        typer.Option(
            "--cases",
            min=1,
            max=1_000_000,
            help="Crossings that the planner's screen judges feasible for unified, or else for the first controller;"
            " cases are drawn until there are as many. [default: 2000, or those of the sweep in --out]",
        ),
    ] = None,
    seed: Annotated[
        int | None,
        typer.Option("--seed", min=0, help="Of all cases. [default: 1, or that of the sweep in --out]"),
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option(
            "--out",
            help="New or empty directory for the results, or that of an interrupted sweep to resume [default:"
            " runs/sweep-DATE-TIME]",
        ),
    ] = None,
    jobs: JobsOption = None,
    rig: Annotated[
        str | None,
        typer.Option(
            "--rig",
            help="Whose robots to draw: {rigs}, or the path of a rig file; docs/sweeps.md says what each has and what"
            " it leaves out."
            " Without a rig the robots differ in mass, inertia and friction by 15 %, and all else is exact but the"
            " encoders' rounding. [default: none, or that of the sweep in --out]",
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help=f"The same as --cases {QUICK_CASES}.")] = False,
    case: Annotated[
        int | None,
        typer.Option(
            "--case",
            min=0,
            help="Repeat only this case, and print its results. With --out, scenario and figure for every"
            " controller are written to that new directory.",
        ),
    ] = None,
    controller: Annotated[
        str | None,
        typer.Option(
            "--controllers",
            "--controller",
            help="Which controllers, separated by commas: some of {controllers}; the last two are not"
            " compiled, hence slow. [default: those that the engine takes, or those of the sweep in --out]",
        ),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Count how many of thousands of random crossings succeed.

    The page shows success rates, errors and causes of failure of one or several controllers. An interrupted sweep
    resumes when it is given the same --out again.

    Example: `fivebar sweep --quick --out runs/sweep`

    Example: `fivebar sweep --rig middling --out runs/middling`

    Example: `fivebar sweep --rig calibrated --controller unified --cases 5000 --out runs/calibrated`

    Example: `fivebar sweep --case 137 --controller unified --out runs/case-137`
    """
    from fivebar_bringup.studies.rigs.rig import named_rig
    from fivebar_control.laws.registry import CONTROLLERS

    with input_errors(), keyboard_interrupts():
        if quick and cases is not None:
            raise InputError("--quick: has its own number of cases: expected either --quick or --cases")
        rig = rig if rig is None else named_rig("--rig", rig)
        controllers = None if controller is None else chosen("--controller", controller, CONTROLLERS)
        if case is not None:
            _one_case(case, seed, controllers, out, as_json, rig or "")
            return
        # here, because it loads matplotlib
        from fivebar_bringup.studies.sweep.sweep import sweep as make

        processes = processes_of(jobs)
        with progress_bar("sweep", as_json) as progress:
            made = make(out, seed, QUICK_CASES if quick else cases, processes, progress, rig, controllers)
    if as_json:
        print(json.dumps(made.content, indent=2, allow_nan=False))
        return
    # as many columns as a narrow terminal has room for; the page has all
    columns = ("controller", "called feasible", "of them made", "share")
    places = [made.overview.columns.index(column) for column in columns]
    table = Table(*columns, box=None)
    for row in made.overview.rows:
        table.add_row(*(row[place].text for place in places))
    printer = Printer()
    printer.print(table)
    met = made.content["met"]
    verdict = ("met", "green") if met else ("not met", "red")
    printer.print(Text.assemble(verdict, f": {made.content['verdict']}"))
    printer.print(f"look at {made.page}", soft_wrap=True)


def _one_case(
    number: int, seed: int | None, names: tuple[str, ...] | None, out: Path | None, as_json: bool, rig: str
) -> None:
    """Print a case, and write its scenarios and figures with --out.

    Raises:
        InputError: the directory cannot be used, or there is nothing to save.
    """
    from fivebar_bringup.recorded.results import finite
    from fivebar_bringup.studies.sweep.directory import DEFAULT_SEED
    from fivebar_bringup.studies.sweep.running import SWEPT
    from fivebar_bringup.studies.sweep.single import rows_of, save_case

    controllers = SWEPT if names is None else names
    number_seed = DEFAULT_SEED if seed is None else seed
    rows = rows_of(number_seed, number, controllers, rig)
    written = [] if out is None else save_case(number_seed, number, controllers, out, rig)
    if as_json:
        print(json.dumps(finite([row._asdict() for row in rows]), indent=2, allow_nan=False))
        return
    printer = Printer()
    for name, value in rows[0].draw._asdict().items():
        printer.print(f"{name}: {value}")
    if not rows[0].controller:
        printer.print(f"refused: {rows[0].reason}", soft_wrap=True)
        return
    table = Table(*SHOWN.values(), box=None)
    for row in rows:
        table.add_row(*(_short(getattr(row, name)) for name in SHOWN))
    printer.print(table)
    for row in rows:
        for reason in (row.why_not, row.reason):
            if reason:
                printer.print(f"{row.controller}: {reason}", soft_wrap=True)
    for path in written:
        printer.print(f"wrote {path}", soft_wrap=True)


def _short(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)
