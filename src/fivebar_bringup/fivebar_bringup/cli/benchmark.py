"""Subcommand that runs and scores the benchmark: benchmark."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer
from rich.table import Table

from fivebar_bringup.cli.app import Group, JobsOption, JsonOption, command, input_errors, processes_of
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_bringup.cli.study_options import chosen
from fivebar_description.interrupts import keyboard_interrupts
from fivebar_description.rounding import in_millimetres


@command(Group.STUDY, former={"--controller": "--controllers"})
def benchmark(
    rigs: Annotated[
        str,
        typer.Option(
            "--rigs", help="Whose robots: some of {rigs}, of robot dextar, or paths of rig files (docs/sweeps.md)."
        ),
    ] = "ideal",
    controllers: Annotated[
        str | None, typer.Option("--controllers", help="Some of {controllers} [default: all]")
    ] = None,
    crossings: Annotated[
        int | None, typer.Option("--crossings", min=1, help="Only the first so many crossings. [default: all]")
    ] = None,
    out: Annotated[
        Path | None,
        typer.Option("--out", help="File for the results, or the one to continue. [default: benchmark.csv]"),
    ] = None,
    score: Annotated[
        Path | None,
        typer.Option("--score", help="Run nothing, and score a file of results, such as one of your own controller."),
    ] = None,
    jobs: JobsOption = None,
    as_json: JsonOption = False,
) -> None:
    """Score controllers on 1000 fixed crossings; also your own.

    The crossings and the rules of success are the same for everybody; --score takes results from elsewhere.

    Example: `fivebar benchmark --rigs calibrated --controllers unified --crossings 100`

    Example: `fivebar benchmark --score mine.csv`
    """
    from fivebar_bringup.recorded.results import finite
    from fivebar_bringup.studies.benchmark.crossings import benchmark as crossings_of
    from fivebar_bringup.studies.benchmark.crossings import checked_rigs
    from fivebar_bringup.studies.benchmark.running import run_benchmark
    from fivebar_bringup.studies.benchmark.scoring import RULES, read_results, scores
    from fivebar_bringup.studies.rigs.rig import named_rigs
    from fivebar_control.laws.registry import CONTROLLERS
    from fivebar_description.text_file import LARGEST_TABLE, read_text

    with input_errors(), keyboard_interrupts():
        every = crossings_of()
        wanted = every[: len(every) if crossings is None else crossings]
        if score is not None:
            results = read_results(read_text(score, LARGEST_TABLE), str(score))
        else:
            names = tuple(CONTROLLERS) if controllers is None else chosen("--controllers", controllers, CONTROLLERS)
            with progress_bar("benchmark", as_json) as progress:
                results = run_benchmark(
                    out if out is not None else Path("benchmark.csv"),
                    checked_rigs(named_rigs("--rigs", rigs)),
                    names,
                    len(wanted),
                    processes_of(jobs),
                    progress,
                )
        found = scores(results, wanted)
    if as_json:
        lines = [one._asdict() | {"interval": one.interval._asdict()} for one in found]
        print(json.dumps(finite({"rules": RULES, "scores": lines}), indent=2, allow_nan=False))
        return
    table = Table("rig", "controller", "success", "95 %", "error, mm", "95 %", "Nm", "stopped", box=None)
    for one in found:
        table.add_row(
            one.rig,
            one.controller,
            f"{one.successes}/{one.crossings}",
            f"{100.0 * one.interval.low:.1f}-{100.0 * one.interval.high:.1f}",
            in_millimetres(one.error_median).removesuffix(" mm"),
            in_millimetres(one.error_95).removesuffix(" mm"),
            f"{one.torque_median:.2f}",
            str(one.stopped),
        )
    printer = Printer()
    printer.print(table)
    printer.print(RULES)
