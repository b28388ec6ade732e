# SPDX-License-Identifier: Apache-2.0
"""Subcommand about a running graph: status."""

from __future__ import annotations

import json
import os
from typing import TYPE_CHECKING, Annotated

import typer
from rich.console import Group as Lines
from rich.table import Table
from rich.text import Text

from fivebar_bringup.cli.app import COMPLETED, FAILED, Group, JsonOption, command, input_errors
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.runs.domain import held_domains
from fivebar_description.errors import InputError
from fivebar_description.interrupts import keyboard_interrupts
from fivebar_description.ros_environment import HIGHEST_DOMAIN, check_ros_environment, domain_of_environment

if TYPE_CHECKING:
    from fivebar_bringup.ros.diagnostics_listener import DiagnosticsListener, NodeReport

COLOURS = {"ok": "green", "warning": "yellow", "error": "red", "stale": "magenta"}

DISCOVERY_TIME = 5.0
"""Longest time (s) until the first node must have been heard."""

LISTENING_TIME = 2.5
"""How long (s) to listen for the others: nodes report once a second."""

OLDEST = 3.0
"""A node that has been silent for longer (s) is stale."""

COLUMNS = ("answered", "rate_hz", "jitter_ms", "late", "dropped")
"""Diagnostics that every node publishes and a narrow terminal has room for; the others follow below the table."""


DomainOption = Annotated[
    int | None,
    typer.Option(
        "--domain",
        min=0,
        max=HIGHEST_DOMAIN,
        help="ROS_DOMAIN_ID of the graph [default: that of the one run of `fivebar run`, else the environment's]",
    ),
]
"""Option for the running graph that is meant; `graph_domain` says which one it is by default."""


@command(Group.RUN)
def status(
    domain: DomainOption = None,
    watch: Annotated[bool, typer.Option("--watch", help="Keep updating until Ctrl-C.")] = False,
    as_json: JsonOption = False,
) -> None:
    """Show the rate, delays and faults of each running node.

    These are the diagnostics that the nodes publish: jitter, late and dropped messages, and more. Exit status 1 where a
    node has a fault or none is found.

    Example: `fivebar status --watch`
    """
    with input_errors():
        check_ros_environment()
        number = graph_domain(domain)
    # here, because it loads ROS
    from fivebar_bringup.ros.diagnostics_listener import DiagnosticsListener

    with input_errors(), keyboard_interrupts(), DiagnosticsListener(number) as listener:
        if listener.wait_for_report(DISCOVERY_TIME):
            listener.take_for(LISTENING_TIME)
        if watch:
            _watch(listener)
        reports = listener.reports(OLDEST)
    if as_json:
        print(json.dumps([report._asdict() for report in reports], indent=2))
    elif not watch:
        Printer().print(_shown(reports) if reports else f"no node of the graph answers in domain {number}")
    sound = bool(reports) and all(report.level in ("ok", "warning") for report in reports)
    raise typer.Exit(COMPLETED if sound else FAILED)


def graph_domain(asked: int | None, environment_first: bool = False) -> int:
    """Return the domain of a graph: that asked for, that of the one run of `fivebar run`, or the environment's.

    Whoever commands the robot puts a domain that the environment names before that of a run.

    Raises:
        InputError: several runs are going on, or the environment names no domain.
    """
    if asked is not None:
        return asked
    if environment_first and os.environ.get("ROS_DOMAIN_ID"):
        return domain_of_environment()
    held = held_domains()
    if len(held) > 1:
        numbers = ", ".join(str(number) for number in held)
        raise InputError(f"--domain: {len(held)} runs are going on, in the domains {numbers}: expected one of them")
    if held:
        return held[0]
    return domain_of_environment()


def _watch(listener: DiagnosticsListener) -> None:
    from rich.live import Live

    try:
        with Live(console=Printer(), auto_refresh=False) as live:
            while True:
                live.update(_shown(listener.reports(OLDEST)), refresh=True)
                listener.take_for(0.5)
    except KeyboardInterrupt:
        pass


def _shown(reports: list[NodeReport]) -> Lines:
    """Return a table of the nodes, and below it what else each of them says."""
    table = Table("node", "level", *COLUMNS, box=None)
    for report in reports:
        colour = COLOURS[report.level]
        figures = (report.figures.get(name, "") for name in COLUMNS)
        table.add_row(report.node, Text(report.level, colour), *figures)
    others = []
    for report in reports:
        parts = [f"{name} {value}" for name, value in report.figures.items() if name not in COLUMNS]
        words = ", ".join(filter(None, (report.message, *parts)))
        if words:
            others.append(Text.assemble((report.node, "bold"), f": {words}"))
    return Lines(table, *others)
