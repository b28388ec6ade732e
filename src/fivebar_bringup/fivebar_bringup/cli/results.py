"""Subcommand that makes the pages of results in the documentation again: results."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Annotated

import typer

from fivebar_bringup.cli.app import Group, JobsOption, JsonOption, command, input_errors, processes_of
from fivebar_bringup.cli.printing import Printer, complain
from fivebar_bringup.cli.progress import progress_bar
from fivebar_bringup.cli.study_options import SchedulerFileOption, SchedulerOption, chosen
from fivebar_description.interrupts import keyboard_interrupts


@command(Group.STUDY)
def results(
    quick: Annotated[bool, typer.Option("--quick", help="Small samples, in some ten minutes.")] = False,
    only: Annotated[
        str | None,
        typer.Option("--only", help="Some of the runs, separated by commas, by name or by study [default: all]"),
    ] = None,
    draw: Annotated[
        bool, typer.Option("--draw", help="Run nothing: draw pages and figures again from their data in --out.")
    ] = False,
    out: Annotated[Path, typer.Option("--out", metavar="DIR", help="Where pages, figures and data are.")] = Path(
        "runs/results/pages"
    ),
    studies: Annotated[
        Path,
        typer.Option("--studies", metavar="DIR", help="Where each study has its rows, from which it resumes."),
    ] = Path("runs/results"),
    jobs: JobsOption = None,
    scheduler: SchedulerOption = None,
    scheduler_file: SchedulerFileOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make the pages of results again, whole in some hours.

    Every page is a question, a figure, a table and limits, and has its data as CSV. An interrupted command resumes when
    it is given again. With --quick, rows of a larger sample that are in --out are left as they are.

    Example: `fivebar results --quick`

    Example: `fivebar results --only sweep,robustness --out docs/results`
    """
    from fivebar_bringup.studies.engine.chunks import defined
    from fivebar_bringup.studies.engine.executor import executor_of
    from fivebar_bringup.studies.results.catalogue import PAGES, RUNS, whole_sample
    from fivebar_bringup.studies.results.making import ResultFiles, make_results

    with input_errors(), keyboard_interrupts():
        of_study = {name: defined(run.study).name for name, run in RUNS.items()}
        wanted = {*RUNS} if only is None else {*chosen("--only", only, (*RUNS, *dict.fromkeys(of_study.values())))}
        runs = [run for name, run in RUNS.items() if not wanted.isdisjoint((name, of_study[name]))]
        files = ResultFiles(out, PAGES, whole_sample)
        if draw:
            written = files.write(PAGES)
        else:
            with executor_of(processes_of(jobs), scheduler, scheduler_file, complain) as executor:
                written = make_results(
                    files, runs, studies, quick, executor, lambda name: progress_bar(name, as_json), complain
                )
    if as_json:
        print(json.dumps([one._asdict() for one in files.made.values()], indent=2, allow_nan=False))
        return
    Printer().print("\n".join(f"look at {path}" for path in written), soft_wrap=True)
