# SPDX-License-Identifier: Apache-2.0
"""Subcommand for work that a program file describes: program."""

from __future__ import annotations

import json
from typing import TYPE_CHECKING, Annotated

import typer
from rich.table import Table

from fivebar_bringup.cli.app import (
    COMPLETED,
    Group,
    JsonOption,
    NamespaceOption,
    OutOption,
    OwnDomainOption,
    PageOption,
    RealtimeOption,
    command,
    input_errors,
    print_outcome,
)
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_bringup.cli.viewing import ViewOption, live_page
from fivebar_bringup.drives.hardware import Hardware
from fivebar_bringup.graph.node_spec import Mode
from fivebar_bringup.recorded.outcome import EXIT_STATUS
from fivebar_bringup.runs.namespace import read_namespace
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts
from fivebar_description.ros_environment import check_ros_environment

if TYPE_CHECKING:
    from fivebar_bringup.motions.program import PlannedProgram


@command(Group.RUN, idle={"--dry-run": ("--domain", "--view", "--namespace", "--out", "--no-page")})
def program(
    file: Annotated[str, typer.Argument(metavar="FILE", help="A program: a YAML file, or a shipped one by its name.")],
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Plan and screen every step, print how long it takes, and move nothing.")
    ] = False,
    realtime: RealtimeOption = False,
    hardware: Annotated[
        Hardware,
        typer.Option(
            help="The simulated robot, or the rehearsal of an experiment, as for `fivebar run`; others are refused."
        ),
    ] = Hardware.SIMULATED,
    domain: OwnDomainOption = None,
    view: ViewOption = False,
    namespace: NamespaceOption = "",
    out: OutOption = None,
    page: PageOption = True,
    as_json: JsonOption = False,
) -> None:
    """Run a file of moves, rests, outputs, payloads and loops.

    The run leaves a bag and a report. All steps are planned and screened before anything moves, and each move again
    before it begins. Exit status 2: a step is refused, and nothing has moved; 1: a fault or a refusal has stopped it,
    with the step and its line.

    Example: `fivebar program pick_and_place --dry-run`

    Example: `fivebar program my_work.yaml --realtime --out runs/work`
    """
    from fivebar_bringup.motions.program import (
        plan_program,
        program_as_json,
        program_path,
        run_program,
        scenario_of_program,
    )
    from fivebar_bringup.runs.launcher import RunOptions
    from fivebar_control.planning.program import load_program

    with input_errors(), keyboard_interrupts():
        if not dry_run:
            check_ros_environment()
        within = read_namespace(namespace)
        if hardware not in (Hardware.SIMULATED, Hardware.EMULATED):
            raise InputError(f"--hardware {hardware}: a program does not run on real drives: expected emulated")
        path = program_path(file)
        loaded = load_program(path)
        scenario = scenario_of_program(loaded, str(path))
        rehearse = hardware is Hardware.EMULATED
        mode = Mode.REALTIME if realtime or rehearse else Mode.LOCKSTEP
        with progress_bar("planning", as_json):
            planned = plan_program(loaded, scenario, str(path), mode)
        content = program_as_json(planned)
        if not as_json:
            _show(planned)
        if dry_run:
            if as_json:
                print(json.dumps(content, indent=2, allow_nan=False))
            raise typer.Exit(COMPLETED)
        with live_page(view, domain, within) as live, progress_bar(loaded.program.name, as_json) as progress:
            options = RunOptions(mode, out, live.domain, progress, within, page)
            directory, summary, last = run_program(loaded, scenario, planned, options, rehearse)
            live.tell(directory, summary)
    if as_json:
        content |= {"program": last, "summary": summary.as_dict()}
        print(json.dumps(content, indent=2, allow_nan=False))
    else:
        print_outcome(directory, summary)
    raise typer.Exit(EXIT_STATUS[summary.outcome])


def _show(planned: PlannedProgram) -> None:
    """Print planned steps as a table, with the odds of the moves where they are known."""
    from fivebar_bringup.motions.program import words_of
    from fivebar_bringup.odds.odds import told_odds

    steps, with_odds = planned.steps, planned.odds is not None
    table = Table("step", "line", "round", "does", "s", *(["odds"] if with_odds else []), box=None)
    for step in steps:
        rounds = " ".join(f"{at}/{count}" for at, count in step.instruction.rounds)
        does = words_of(step.instruction)
        if len(step.planned.segments) > 1:
            does += f", in {len(step.planned.segments)} stretches"
        told = step.planned.odds
        odds = [("" if told is None else told_odds(told, short=True))] if with_odds else []
        table.add_row(step.instruction.number, str(step.instruction.line), rounds, does, f"{step.duration:.3f}", *odds)
    printer = Printer(soft_wrap=True)
    printer.print(table, highlight=False)
    printer.print(f"{len(steps)} steps, {sum(step.duration for step in steps):.3f} s", highlight=False)
    if planned.odds is not None:
        printer.print(f"odds of all moves: {planned.odds}", highlight=False)
