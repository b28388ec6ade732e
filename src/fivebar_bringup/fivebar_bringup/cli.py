"""The `fivebar` command."""

from __future__ import annotations

import json
import signal
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import FrameType
from typing import Annotated, NoReturn

import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from fivebar_bringup.bag.recording import BagError
from fivebar_bringup.graph import Mode, crossing_graph
from fivebar_bringup.maps.map import make_map, new_map_directory, read_mappable_robot
from fivebar_bringup.report.report import write_report
from fivebar_bringup.report.summary import Summary
from fivebar_bringup.run import RunFailed, run_offline, run_with_ros
from fivebar_bringup.run_directory import RunDirectory
from fivebar_bringup.scenario import load_scenario, shipped_scenarios
from fivebar_description.strict_yaml import InputError

COMPLETED, FAILED, BAD_INPUT = 0, 1, 2

app = typer.Typer(
    help="Drive a five-bar parallel robot through its Type 2 singularities.",
    no_args_is_help=True,
    add_completion=False,
    rich_markup_mode="markdown",
    pretty_exceptions_enable=False,
)
console = Console(stderr=True)

ScenarioArgument = Annotated[
    str,
    typer.Argument(metavar="SCENARIO", help=f"A YAML file, or a shipped scenario: {', '.join(shipped_scenarios())}."),
]
OutOption = Annotated[
    Path | None,
    typer.Option("--out", help="New or empty directory for the results [default: runs/SCENARIO-DATE-TIME]"),
]
JsonOption = Annotated[bool, typer.Option("--json", help="Print the result as JSON on standard output, nothing else.")]


@app.command()
def run(
    scenario: ScenarioArgument,
    realtime: Annotated[
        bool, typer.Option("--realtime", help="Follow the clock instead of waiting for every node (lockstep).")
    ] = False,
    domain: Annotated[
        int | None,
        typer.Option("--domain", min=0, max=101, help="ROS_DOMAIN_ID to use [default: a free one, for this run only]"),
    ] = None,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """Run SCENARIO with all ROS nodes as processes, record a bag, and write the report.

    Example: `fivebar run middle --out runs/first`
    """
    with _input_errors(), _ending_on_sigterm():
        loaded = load_scenario(scenario)
        mode = Mode.REALTIME if realtime else Mode.LOCKSTEP
        with _progress_bar(loaded.name, as_json) as progress:
            directory, summary = run_with_ros(loaded, mode, out, domain, progress)
    _finish(directory, summary, as_json)


@app.command()
def simulate(scenario: ScenarioArgument, out: OutOption = None, as_json: JsonOption = False) -> None:
    """Run SCENARIO in this process, without ROS: the same controllers and plant, the same bag and report.

    Example: `fivebar simulate middle --json`
    """
    with _input_errors(), _ending_on_sigterm():
        loaded = load_scenario(scenario)
        with _progress_bar(loaded.name, as_json) as progress:
            directory, summary = run_offline(loaded, out, progress)
    _finish(directory, summary, as_json)


@app.command()
def report(
    directory: Annotated[Path, typer.Argument(metavar="DIR", help="Directory of a run.")], as_json: JsonOption = False
) -> None:
    """Make figures, page and summary of the run in DIR anew from its bag.

    Example: `fivebar report runs/first`
    """
    run_directory = RunDirectory(directory)
    with _input_errors():
        summary = write_report(run_directory)
    _finish(run_directory, summary, as_json)


@app.command(name="map")
def map_robot(
    robot: Annotated[
        str, typer.Argument(metavar="ROBOT", help="A shipped robot (dextar, unequal), or a parameter file (.yaml).")
    ] = "dextar",
    out: Annotated[
        Path | None,
        typer.Option("--out", help="New or empty directory for the results [default: runs/map-ROBOT-DATE-TIME]"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """Draw the workspace of ROBOT and its singularities, over the platform's plane and over the motor angles.

    Example: `fivebar map dextar --out runs/map`
    """
    with _input_errors(), _ending_on_sigterm():
        file = read_mappable_robot(robot)
        directory = new_map_directory(out, file.name)
        with _progress_bar(f"map of {file.name}", as_json) as progress:
            measures = make_map(file, directory, progress)
    if as_json:
        print(json.dumps(measures, indent=2, allow_nan=False))
    else:
        Console().print(f"look at {directory.page}", soft_wrap=True)


@app.command()
def reproduce(
    out: Annotated[
        Path | None,
        typer.Option("--out", help="New or empty directory for the results [default: runs/reproduce-DATE-TIME]"),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="One duration and one perturbed plant only.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Make the figures and claims of the thesis again, without ROS, and judge each by what is measured.

    Example: `fivebar reproduce --out runs/thesis`
    """
    # here, because it loads matplotlib
    from fivebar_bringup.reproduce.reproduce import reproduce as make

    with _input_errors(), _ending_on_sigterm(), _progress_bar("reproduction", as_json) as progress:
        made = make(out, quick, progress)
    if as_json:
        print(json.dumps(made.content, indent=2, allow_nan=False))
        return
    table = Table("thesis", "about", "verdict", box=None)
    for row in made.rows:
        table.add_row(row.place, row.title, str(row.judgement.verdict))
    Console().print(table)
    Console().print(f"look at {made.page}", soft_wrap=True)


@app.command()
def nodes(
    scenario: ScenarioArgument = "middle",
    as_json: JsonOption = False,
) -> None:
    """Show the graph of SCENARIO: its nodes, and the topics and types that join them.

    Example: `fivebar nodes middle`
    """
    with _input_errors():
        graph = crossing_graph(load_scenario(scenario), Mode.LOCKSTEP, Path("bag"))
    if as_json:
        listing = [
            {
                "node": node.executable,
                "package": node.package,
                "subscribes": {topic.name: topic.type for topic in node.subscribes},
                "publishes": {topic.name: topic.type for topic in node.publishes},
            }
            for node in graph
        ]
        print(json.dumps(listing, indent=2))
        return
    table = Table("node", "package", "subscribes", "publishes", title="The node graph", show_lines=True)
    table.columns[0].no_wrap = True
    for column in table.columns[1:]:
        column.overflow = "fold"
    for node in graph:
        publishes = (f"{topic.name} [dim]{topic.type}[/dim]" for topic in node.publishes)
        subscribes = (topic.name for topic in node.subscribes)
        table.add_row(node.executable, node.package, "\n".join(subscribes), "\n".join(publishes))
    Console().print(table)


def main() -> None:
    """Run the command."""
    app()


def _finish(directory: RunDirectory, summary: Summary, as_json: bool) -> NoReturn:
    """Print the outcome and exit with its status."""
    content = summary.as_json()
    if as_json:
        print(json.dumps(content, indent=2, allow_nan=False))
    else:
        _print_summary(directory, summary)
    raise typer.Exit(COMPLETED if summary.completed else FAILED)


def _print_summary(directory: RunDirectory, summary: Summary) -> None:
    table = Table(show_header=False, box=None)
    for key, value in summary.as_json().items():
        table.add_row(f"[dim]{key}[/dim]", json.dumps(value))
    printer = Console()
    printer.print(table)
    verdict = "[green]completed[/green]" if summary.completed else "[red]not completed[/red]"
    printer.print(f"{verdict}: look at {directory.page}", soft_wrap=True)


@contextmanager
def _input_errors() -> Iterator[None]:
    """Turn bad input, and a run without a result, into one line on standard error and exit status 2 or 1."""
    try:
        yield
    except (InputError, BagError) as error:
        print(f"fivebar: {error}", file=sys.stderr)
        raise typer.Exit(BAD_INPUT) from error
    except RunFailed as error:
        print(f"fivebar: the run failed: {error}", file=sys.stderr)
        raise typer.Exit(FAILED) from error


@contextmanager
def _ending_on_sigterm() -> Iterator[None]:
    """Let SIGTERM end a run in the same orderly way as Ctrl-C."""

    def interrupt(number: int, frame: FrameType | None) -> None:
        raise KeyboardInterrupt

    previous = signal.signal(signal.SIGTERM, interrupt)
    try:
        yield
    finally:
        signal.signal(signal.SIGTERM, previous)


@contextmanager
def _progress_bar(name: str, quiet: bool) -> Iterator[Callable[[int, int], None]]:
    """Show how many samples are done, on standard error."""
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeElapsedColumn())
    # a bar is for watching: in a file or a pipe it would only be a stray line beside the errors
    with Progress(*columns, console=console, disable=quiet or not console.is_terminal) as progress:
        task = progress.add_task(f"{name}: starting", total=None)

        def update(done: int, total: int) -> None:
            progress.update(task, description=f"{name}: running", completed=done, total=total)

        yield update


if __name__ == "__main__":
    main()
