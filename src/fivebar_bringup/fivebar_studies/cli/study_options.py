# SPDX-License-Identifier: Apache-2.0
"""Options that commands of studies share, and how such a command runs its study."""

from __future__ import annotations

import json
from collections.abc import Collection, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NamedTuple

import typer

from fivebar_bringup.cli.app import processes_of
from fivebar_bringup.cli.printing import Printer, complain
from fivebar_bringup.cli.progress import progress_bar
from fivebar_bringup.cli.words import WORDS
from fivebar_description.errors import InputError
from fivebar_description.modules import load_part
from fivebar_description.suggestion import expected_one_of

if TYPE_CHECKING:
    from rich.text import Text

    from fivebar_bringup.pages.content import Table as PageTable
    from fivebar_studies.engine.running import FinishedStudy

StudyOutOption = Annotated[
    Path | None,
    typer.Option(
        "--out",
        help="New or empty directory for the results, or that of an interrupted study to resume [default:"
        " runs/STUDY-DATE-TIME]",
    ),
]
SchedulerOption = Annotated[
    str | None,
    typer.Option(
        "--scheduler",
        metavar="ADDRESS",
        help="Run on a Dask cluster, such as tcp://127.0.0.1:8786; its scheduler is trusted with code.",
    ),
]
SchedulerFileOption = Annotated[
    Path | None, typer.Option("--scheduler-file", help="The same, by the file that the scheduler has written.")
]

StudyRobotOption = Annotated[
    str | None,
    typer.Option(
        "--robot",
        metavar="ROBOT",
        help="A shipped robot, or a robot file (.yaml): limits and tolerances go with its torque and size."
        " [default: dextar, or that of the rig or the scenarios]",
    ),
]


def _rigs() -> str:
    from fivebar_studies.rigs.named import shipped_rigs

    return ", ".join(shipped_rigs())


WORDS["rigs"] = _rigs


def controllers_option(default: str) -> Any:
    """Return the option `--controllers` of a study, with the words for those that it runs by default."""
    return typer.Option(
        "--controllers",
        help="Which, separated by commas: some of {controllers}, or laws of your own as my_package.my_law:LAW."
        f" [default: {default}, or those of the study in --out]",
    )


class Machines(NamedTuple):
    """Where a study is run, as `--jobs`, `--scheduler` and `--scheduler-file` say it."""

    jobs: int | None
    scheduler: str | None
    scheduler_file: Path | None


def run_command(
    place: str, arguments: Mapping[str, Any], out: Path | None, machines: Machines, as_json: bool
) -> FinishedStudy:
    """Run the study that is defined at a place, `MODULE:NAME`, and show its progress.

    Raises:
        InputError: the directory, the settings or the cluster cannot be used.
        ResumableInterrupt: it was interrupted.
    """
    from fivebar_studies.engine.cluster import cluster_of
    from fivebar_studies.engine.executor import LocalProcesses
    from fivebar_studies.engine.running import run_study

    study = load_part(place)
    local = machines.scheduler is None and machines.scheduler_file is None
    with (
        progress_bar(study.name, as_json) as progress,
        LocalProcesses(processes_of(machines.jobs))
        if local
        else cluster_of(machines.scheduler, machines.scheduler_file, complain) as executor,
    ):
        return run_study(study, arguments, out, executor, progress)


def chosen_controllers(text: str | None) -> tuple[str, ...] | None:
    """Return the controllers in a list that is separated by commas, each once; None for no list.

    Raises:
        InputError: one of them is not known, or its law cannot be loaded.
    """
    from fivebar_control.laws.registry import find_controller

    try:
        return None if text is None else tuple(dict.fromkeys(find_controller(name).name for name in _listed(text)))
    except InputError as error:
        raise InputError(f"--controllers: {str(error).removeprefix('controller: ')}") from error


def chosen(option: str, text: str, known: Collection[str]) -> tuple[str, ...]:
    """Return the names in a list that is separated by commas, each once.

    Raises:
        InputError: one of them is not known.
    """
    names = tuple(dict.fromkeys(_listed(text)))
    for name in names:
        if name not in known:
            words = expected_one_of(name, known, ", separated by commas", "some of")
            raise InputError(f"{option}: {name!r}: {words}")
    return names


def _listed(text: str) -> list[str]:
    return [name.strip() for name in text.split(",")]


def show_study(
    finished: FinishedStudy, as_json: bool, table: PageTable, columns: Sequence[str], lines: Sequence[str | Text] = ()
) -> None:
    """Print a finished study: all of it as JSON, or some columns of a table, lines, and where its page is."""
    if as_json:
        print(json.dumps(finished.content, indent=2, allow_nan=False))
        return
    printer = Printer()
    print_table(printer, table, columns)
    for line in lines:
        printer.print(line)
    printer.print(f"look at {finished.page}", soft_wrap=True)


def print_table(printer: Printer, shown: PageTable, columns: Sequence[str]) -> None:
    """Print some columns of a page's table: as many as a narrow terminal has room for."""
    from rich.table import Table

    places = [shown.columns.index(column) for column in columns]
    table = Table(*columns, box=None)
    for row in shown.rows:
        table.add_row(*(row[place].text for place in places))
    printer.print(table)
