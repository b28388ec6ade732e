"""Subcommand that compares all controllers: compare."""

from __future__ import annotations

import json
import math
import shlex
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table
from rich.text import Text

from fivebar_bringup.cli.app import Group, JobsOption, JsonOption, command, input_errors, processes_of
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_bringup.cli.study_options import chosen_controllers
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts

LONGEST = 60.0
"""Duration of a segment (s) above which a typing error is more likely."""

COLOURS = {True: "green", False: "red", None: "yellow"}
WORDS = {True: "met", False: "not met", None: "not known"}


@command(Group.STUDY, former={"--controller": "--controllers"})
def compare(
    scenarios: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[SCENARIO]...",
            help="YAML files or shipped scenarios, whose motions are run [default: middle multiple]",
        ),
    ] = None,
    controllers: Annotated[
        str | None,
        typer.Option("--controllers", help="Some of {controllers}, or my_package.my_law:LAW [default: all]"),
    ] = None,
    durations: Annotated[
        str | None, typer.Option("--durations", help="Of every segment, in seconds [default: 0.5,1,2,3]")
    ] = None,
    rigs: Annotated[
        str | None,
        typer.Option(
            "--rigs",
            help="Some of {rigs}, paths of rig files, or as_given; without the errors that a sweep draws [default:"
            " ideal,wrong,encoders,realistic, and as_given where a scenario's plant is none of them]",
        ),
    ] = None,
    jobs: JobsOption = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="New or empty directory for the results [default: runs/compare-DATE-TIME]"),
    ] = None,
    as_json: JsonOption = False,
    quick: Annotated[
        bool, typer.Option("--quick", help="By default only middle, 1 s, and the rigs ideal and realistic.")
    ] = False,
) -> None:
    """Run the same motions with every controller, side by side.

    It runs without ROS, and shows success, errors, torques, margins and energy.

    Example: `fivebar compare middle --durations 0.5,1 --rigs ideal,realistic --out runs/compared`
    """
    from fivebar_bringup.scenarios.scenario_files import load_scenario
    from fivebar_bringup.studies.compare.cases import ComparisonExtent
    from fivebar_bringup.studies.compare.compare import compare as make
    from fivebar_control.laws.registry import CONTROLLERS

    with input_errors(), keyboard_interrupts():
        names = scenarios or (["middle"] if quick else ["middle", "multiple"])
        extent = ComparisonExtent(
            given=tuple(load_scenario(name) for name in names),
            controllers=chosen_controllers(controllers) or tuple(CONTROLLERS),
            durations=_durations(durations if durations is not None else "1" if quick else "0.5,1,2,3"),
            rigs=_rigs(rigs, quick),
        )
        _refuse_namesakes([given.name for given in extent.given])
        command = _command(names, extent.controllers, extent.durations, rigs, quick)
        with progress_bar("comparison", as_json) as progress:
            made = make(extent, out, processes_of(jobs), command, progress)
    if as_json:
        print(json.dumps(made.content, indent=2, allow_nan=False))
        return
    printer = Printer()
    # as many columns as a narrow terminal has room for; the page has all
    table = Table(*("rig", "controller", "succeeded", "error", "applied", "requested", "saturated"), box=None)
    places = [made.overview.columns.index(str(column.header)) for column in table.columns]
    for row in made.overview.rows:
        table.add_row(*(row[place].text for place in places))
    printer.print(table)
    for finding in made.verdicts:
        verdict = WORDS[finding.met], COLOURS[finding.met]
        printer.print(Text.assemble(verdict, f": {finding.title}: {finding.measured}"))
    printer.print(f"look at {made.page}", soft_wrap=True)


def _rigs(text: str | None, quick: bool) -> tuple[str, ...] | None:
    """Return the rigs, None for the default ones.

    Raises:
        InputError: one of them is not known, or its file does not describe one.
    """
    from fivebar_bringup.studies.compare.cases import AS_GIVEN
    from fivebar_bringup.studies.rigs.rig import named_rigs

    if text is None:
        return ("ideal", "realistic") if quick else None
    return named_rigs("--rigs", text, (AS_GIVEN,))


def _durations(text: str) -> tuple[float, ...]:
    """Return durations (s) in order, each once.

    Raises:
        InputError: one of them is no duration.
    """
    durations = set()
    for part in text.split(","):
        try:
            duration = float(part)
        except ValueError:
            duration = math.nan
        if not 0.0 < duration <= LONGEST:
            raise InputError(
                f"--durations: {part.strip()!r}: expected seconds above 0 and up to {LONGEST:g}, separated by commas"
            )
        durations.add(duration)
    return tuple(sorted(durations))


def _refuse_namesakes(names: list[str]) -> None:
    for name in names:
        if names.count(name) > 1:
            raise InputError(f"scenario {name!r}: is given more than once: expected scenarios with names of their own")


def _command(
    names: list[str], controllers: tuple[str, ...], durations: tuple[float, ...], rigs: str | None, quick: bool
) -> str:
    """Return the command that repeats a comparison, with all options that affect its results."""
    parts = ["fivebar", "compare", *names, "--controllers", ",".join(controllers)]
    parts += ["--durations", ",".join(f"{duration:g}" for duration in durations)]
    parts += ["--rigs", rigs] if rigs is not None else []
    parts += ["--quick"] if quick else []
    return shlex.join(parts)
