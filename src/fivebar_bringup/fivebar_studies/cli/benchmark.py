# SPDX-License-Identifier: Apache-2.0
"""Subcommand that runs and scores the benchmark: benchmark."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from fivebar_bringup.cli.app import Group, JobsOption, JsonOption, command, input_errors
from fivebar_bringup.cli.printing import Printer, complain
from fivebar_bringup.simulation.observation import Observation
from fivebar_description.interrupts import keyboard_interrupts
from fivebar_studies.cli.study_options import (
    Machines,
    SchedulerFileOption,
    SchedulerOption,
    StudyOutOption,
    StudyRobotOption,
    chosen_controllers,
    controllers_option,
    print_table,
    run_command,
)


@command(
    Group.STUDY,
    former={"--controller": "--controllers", "--rigs": "--rig", "--crossings": "--cases"},
    idle={"--score": ("--policy", "--observation", "--out", "--jobs", "--scheduler", "--scheduler-file")},
)
def benchmark(
    cases: Annotated[
        int | None,
        typer.Option("--cases", min=1, max=1000, help="Only the first so many crossings. [default: all]"),
    ] = None,
    controllers: Annotated[str | None, controllers_option("all but path")] = None,
    rig: Annotated[
        str | None,
        typer.Option(
            "--rig",
            help="Whose robots, separated by commas: some of {rigs}, all of one robot, or paths of rig files"
            " (docs/sweeps.md); ideal or encoders with --robot. [default: ideal]",
        ),
    ] = None,
    robot: StudyRobotOption = None,
    policy: Annotated[
        str | None,
        typer.Option(
            "--policy",
            metavar="MODULE:NAME",
            help="Besides, a function of the observation that returns both torques in Nm, or a class whose objects do.",
        ),
    ] = None,
    observation: Annotated[
        Observation | None,
        typer.Option(
            "--observation", help="The encoders that it reads: on all joints, or on the motors alone. [default: all]"
        ),
    ] = None,
    out: StudyOutOption = None,
    score: Annotated[
        Path | None,
        typer.Option("--score", help="Run nothing, and score a file of results, such as one of your own controller."),
    ] = None,
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    scheduler_file: SchedulerFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Score controllers on 1000 fixed crossings; also your own.

    The crossings and the rules of success are the same for everybody; --policy takes any function of the observation,
    --score results from elsewhere.

    Example: `fivebar benchmark --rig calibrated --controllers unified --cases 100`

    Example: `fivebar benchmark --policy my_module:policy --controllers unified --cases 100`

    Example: `fivebar benchmark --score mine.csv`
    """
    from fivebar_description.files import LARGEST_TABLE, read_text
    from fivebar_studies.benchmark.running import check_policy_of
    from fivebar_studies.benchmark.scoring import read_results
    from fivebar_studies.benchmark.study import BENCHMARK
    from fivebar_studies.rigs.declared import robot_name
    from fivebar_studies.rigs.named import named_rigs

    with input_errors(), keyboard_interrupts():
        settings = {
            "rigs": None if rig is None else named_rigs("--rig", rig),
            "controllers": chosen_controllers(controllers),
            "cases": cases,
            "robot": None if robot is None else robot_name(robot),
            "policy": policy,
            "observation": observation,
        }
        if score is not None:
            results = read_results(read_text(score, LARGEST_TABLE), str(score))
            report = BENCHMARK.report(BENCHMARK.settings_with(settings), results)
            content, shown, page = report.content, report.shown, None
        else:
            if out is not None and out.suffix == ".csv":
                out = out.with_suffix("")
                complain(f"--out FILE.csv is deprecated: the results are in {out / 'benchmark.csv'}")
            check_policy_of(BENCHMARK.settings_with(settings))
            machines = Machines(jobs, scheduler, scheduler_file)
            finished = run_command(BENCHMARK.place, settings, out, machines, as_json)
            content, shown, page = finished.content, finished.shown, finished.page
    if as_json:
        from fivebar_bringup.recorded.results import finite

        print(json.dumps(finite(content), indent=2, allow_nan=False))
        return
    printer = Printer()
    print_table(printer, shown, shown.columns)
    printer.print(shown.note)
    if page is not None:
        printer.print(f"look at {page}", soft_wrap=True)
