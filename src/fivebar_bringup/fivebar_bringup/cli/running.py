# SPDX-License-Identifier: Apache-2.0
"""Subcommands about one run: run, simulate, report, nodes."""

from __future__ import annotations

import json
import os
import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, NoReturn

import typer
from rich.table import Table
from rich.text import Text

from fivebar_bringup.cli.app import (
    Group,
    JsonOption,
    NamespaceOption,
    OutOption,
    OwnDomainOption,
    PageOption,
    RealtimeOption,
    RecordedNamespaceOption,
    ScenarioArgument,
    SetOption,
    command,
    input_errors,
    print_outcome,
)
from fivebar_bringup.cli.printing import Printer
from fivebar_bringup.cli.progress import progress_bar
from fivebar_bringup.cli.viewing import ViewOption, live_page
from fivebar_bringup.drives.hardware import Hardware
from fivebar_bringup.graph.node_spec import Mode, Sharing
from fivebar_bringup.recorded.outcome import EXIT_STATUS
from fivebar_bringup.runs.namespace import read_namespace
from fivebar_bringup.runs.parent_death import interrupt_with
from fivebar_description.errors import InputError
from fivebar_description.interface import DEFAULT_PRIORITY, HIGHEST_PRIORITY
from fivebar_description.interrupts import keyboard_interrupts
from fivebar_description.ros_environment import check_ros_environment, domain_of_environment

if TYPE_CHECKING:
    from fivebar_bringup.recorded.run_directory import RunDirectory
    from fivebar_bringup.recorded.summary import Summary


@command(Group.RUN)
def run(
    scenario: ScenarioArgument,
    changes: SetOption = None,
    realtime: RealtimeOption = False,
    domain: OwnDomainOption = None,
    separate: Annotated[
        bool, typer.Option("--separate", help="With --realtime: every node in a process of its own.")
    ] = False,
    together: Annotated[
        bool,
        typer.Option(
            "--together",
            help="With --hardware: the bridge in the process of the control chain, so that a torque is written to the"
            " drives before anything else is published.",
        ),
    ] = False,
    priority: Annotated[
        int | None,
        typer.Option(
            min=0,
            max=HIGHEST_PRIORITY,
            help="With --realtime: priority of the control chain under SCHED_FIFO, 0 for ordinary scheduling. Where the"
            f" system does not grant it, the nodes warn in their logs and go on. [default: {DEFAULT_PRIORITY}]",
        ),
    ] = None,
    processors: Annotated[
        str, typer.Option(help='With --realtime: processors for the control chain, such as "0,2".')
    ] = "",
    hardware: Annotated[
        Hardware,
        typer.Option(
            help="The simulated robot; the rehearsal of an experiment, with a bridge and emulated drives or an emulated"
            " motor board; two real drives on a CAN bus; a real motor board, which powers its motors; joints under a"
            " controller manager of ros2_control; or real drives of any installed interface."
        ),
    ] = Hardware.SIMULATED,
    activate: Annotated[
        bool,
        typer.Option(
            "--activate",
            help="With --hardware socketcan, external or real: enable the drives as soon as all nodes are ready."
            " Without, the bridge waits for the operator's `configure` and `activate`, and the run is in the domain of"
            " the shell.",
        ),
    ] = False,
    port: Annotated[
        str | None, typer.Option(metavar="DEVICE", help="With --hardware usb: its port, such as /dev/ttyACM0.")
    ] = None,
    inject: Annotated[
        list[str] | None,
        typer.Option(
            metavar="'SECONDS FAULT'",
            help="With --hardware emulated, again and again: a fault after so many seconds: {drive_faults}, kill NODE."
            " Drives of another interface have others, which the refusal of a wrong one lists.",
        ),
    ] = None,
    drives: Annotated[
        str | None,
        typer.Option(
            metavar="FILE",
            help="Configuration of the bridge to the drives, by name or path. [default: the scenario's, else that of"
            " the robot's interface, such as {drive_files}]",
        ),
    ] = None,
    scene: Annotated[
        bool, typer.Option("--scene", help="Publish and record pictures of the run for RViz and Foxglove.")
    ] = False,
    view: ViewOption = False,
    namespace: NamespaceOption = "",
    out: OutOption = None,
    page: PageOption = True,
    as_json: JsonOption = False,
    parent: Annotated[int | None, typer.Option(hidden=True, help="Process that started this one and ends it.")] = None,
) -> None:
    """Run a motion with all ROS nodes; leave bag and report.

    The nodes of SCENARIO are processes that talk by topics, as on a robot. By default the plant waits for them, so that
    the result does not depend on the speed of this machine.

    Example: `fivebar run middle --out runs/first`

    Example: `fivebar run middle_robot --hardware emulated --inject "1.2 fault 1"`

    Example: `fivebar run motkin_middle --hardware usb --port /dev/ttyACM0`

    Example: `fivebar run experiment.yaml --hardware socketcan --drives drives.yaml`

    Example: `fivebar run experiment.yaml --hardware external --drives joints.yaml --namespace fivebar`
    """
    from fivebar_bringup.drives.choice import interface_of_run, kind_of, real_drives
    from fivebar_bringup.runs.admission import load_with_odds
    from fivebar_bringup.runs.injection import read_injection, refuse_late
    from fivebar_bringup.runs.launcher import RunOptions
    from fivebar_bringup.runs.run import Rehearsed, run_with_ros
    from fivebar_bringup.scenarios.changes import read_changes
    from fivebar_description.modules import load_part
    from fivebar_description.ros.scheduling import Scheduling

    with input_errors(), keyboard_interrupts():
        if parent is not None:
            interrupt_with(parent)
        check_ros_environment()
        within = read_namespace(namespace)
        admitted = load_with_odds(scenario, read_changes(changes))
        loaded = admitted.scenario
        emulated, simulated = hardware is Hardware.EMULATED, hardware is Hardware.SIMULATED
        if inject and not emulated:
            raise InputError("--inject: expected --hardware emulated, whose drives and nodes can be broken")
        if drives is not None and simulated:
            raise InputError("--drives: expected --hardware emulated, real, external, socketcan or usb")
        interface = None if simulated else interface_of_run(loaded, drives)
        kind = None if interface is None else kind_of(loaded, drives)
        real = None if kind is None or emulated else real_drives(loaded, kind, hardware, drives, port)
        if real is None and port is not None:
            raise InputError("--port: expected together with --hardware usb or real, and only there")
        if activate and (real is None or real.port is not None):
            raise InputError(
                "--activate: expected --hardware socketcan, external or real, where drives wait for the operator"
            )
        if real is not None:
            # a board behind a port is enabled at once
            real = real._replace(activate=activate or real.port is not None)
        mode = Mode.LOCKSTEP if simulated and not realtime else Mode.REALTIME
        _refuse_scheduling(mode, separate, processors, priority)
        sharing = _sharing(separate, together, simulated)
        injections = None if kind is None or not emulated else [read_injection(text, kind) for text in inject or ()]
        refuse_late(injections or (), loaded.plan().path.duration)
        if kind is not None and real is not None and not real.activate:
            domain = _for_the_operator(kind.bridge, domain, within)
        elif kind is not None and real is not None and kind.on_topics and domain is None:
            domain = domain_of_environment()
        if kind is not None and real is not None and kind.awaited and domain is not None:
            load_part(kind.awaited)(loaded, real.configuration, domain)
        with live_page(view, domain, within, interface) as live, progress_bar(loaded.name, as_json) as progress:
            directory, summary = run_with_ros(
                loaded,
                RunOptions(mode, out, live.domain, progress, within, page, admitted.kept),
                Rehearsed(injections, drives) if injections is not None else real,
                Scheduling(DEFAULT_PRIORITY if priority is None else priority, processors),
                sharing,
                scene,
            )
            live.tell(directory, summary)
    _finish(directory, summary, as_json)


def _for_the_operator(bridge: str, domain: int | None, namespace: str) -> int:
    """Say who begins the run, and return the domain in which that can be: the given one, or that of the shell."""
    chosen = domain if domain is not None else domain_of_environment()
    name = f"{namespace}/{bridge}"
    print(
        f"fivebar: the drives are enabled by you, with ROS_DOMAIN_ID={chosen}: ros2 lifecycle set {name} configure,"
        f" then ros2 lifecycle set {name} activate",
        file=sys.stderr,
    )
    return chosen


def _sharing(separate: bool, together: bool, simulated: bool) -> Sharing | None:
    """Return which nodes share a process, None for the default.

    Raises:
        InputError: the options do not go together.
    """
    if not together:
        return Sharing.NONE if separate else None
    if separate:
        raise InputError("--together: expected without --separate")
    if simulated:
        raise InputError("--together: expected with --hardware, where there is a bridge")
    return Sharing.ROBOT


def _refuse_scheduling(mode: Mode, separate: bool, processors: str, priority: int | None) -> None:
    """Refuse processors that this machine does not have, and what is for runs in real time elsewhere."""
    from fivebar_description.ros.scheduling import processor_set, processors_problem

    options = {"--separate": separate, "--processors": processors, "--priority": priority is not None}
    for option, is_given in options.items():
        if mode is not Mode.REALTIME and is_given:
            raise InputError(f"{option}: expected with --realtime or --hardware")
    there = os.sched_getaffinity(0)
    problem = processors_problem(processors)
    if problem is None and not processor_set(processors) <= there:
        problem = f"expected some of {', '.join(map(str, sorted(there)))}"
    if problem is not None:
        raise InputError(f"--processors: {processors!r}: {problem}")


@command(Group.RUN)
def simulate(
    scenario: ScenarioArgument,
    changes: SetOption = None,
    out: OutOption = None,
    page: PageOption = True,
    as_json: JsonOption = False,
) -> None:
    """Run a motion without ROS; leave the same bag and report.

    The controllers and the plant are those of `fivebar run`, in one process; the results are equal bit for bit.

    Example: `fivebar simulate middle --json`

    Example: `fivebar simulate middle --set gains.kp=900 --set plant.friction.stribeck=1.3`
    """
    from fivebar_bringup.runs.admission import load_with_odds
    from fivebar_bringup.runs.offline import run_offline
    from fivebar_bringup.scenarios.changes import read_changes

    with input_errors(), keyboard_interrupts():
        admitted = load_with_odds(scenario, read_changes(changes))
        loaded = admitted.scenario
        with progress_bar(loaded.name, as_json) as progress:
            directory, summary = run_offline(loaded, out, progress, page, admitted.kept)
    _finish(directory, summary, as_json)


@command(Group.FILES)
def report(
    directories: Annotated[
        list[Path], typer.Argument(metavar="DIR [OTHER]", help="Directory of a run, or of two to play together.")
    ],
    gif: Annotated[bool, typer.Option("--gif", help="Also write the robot's motion as animation.gif.")] = False,
    mp4: Annotated[bool, typer.Option("--mp4", help="Also write animation.mp4, which needs ffmpeg.")] = False,
    namespace: RecordedNamespaceOption = None,
    as_json: JsonOption = False,
) -> None:
    """Make figures and page of a recorded run again.

    With OTHER, the page plays two runs together.

    Example: `fivebar report runs/first --gif`

    Example: `fivebar report runs/first runs/second`
    """
    from fivebar_bringup.recorded.run_directory import RunDirectory
    from fivebar_bringup.report.report import write_animation, write_report

    run_directory, *others = (RunDirectory(directory) for directory in directories)
    with input_errors():
        if others:
            _overlay(run_directory, others, gif or mp4, namespace, as_json)
        within = None if namespace is None else read_namespace(namespace)
        with progress_bar(str(run_directory.path), as_json):
            summary = write_report(run_directory, namespace=within)
            suffixes = [name for name, wanted in (("gif", gif), ("mp4", mp4)) if wanted]
            paths = [write_animation(run_directory, suffix, within) for suffix in suffixes]
        for path in paths:
            if not as_json:
                Printer().print(f"animation: {path}", soft_wrap=True)
    _finish(run_directory, summary, as_json)


def _overlay(
    first: RunDirectory, others: list[RunDirectory], animated: bool, within: str | None, as_json: bool
) -> NoReturn:
    """Write the page of two runs, print where it is or both summaries, and exit."""
    from fivebar_bringup.report.report import write_overlay

    if len(others) > 1 or animated or within is not None:
        raise InputError("report: expected one run, or two without --gif, --mp4 and --namespace")
    with progress_bar("both runs", as_json):
        page, summaries = write_overlay(first, others[0])
    if as_json:
        print(json.dumps([summary.as_dict() for summary in summaries], indent=2, allow_nan=False))
    else:
        Printer().print(f"both runs: look at {page}", soft_wrap=True)
    raise typer.Exit(max(EXIT_STATUS[summary.outcome] for summary in summaries))


@command(Group.FILES)
def nodes(
    scenario: ScenarioArgument = "middle",
    import_law: Annotated[
        bool,
        typer.Option(
            "--import-law",
            help="Import the module of a law from elsewhere, `controller: MODULE:NAME`, which runs its code: without"
            " it the graph of such a scenario is not known.",
        ),
    ] = False,
    svg: Annotated[bool, typer.Option("--svg", help="Print a drawing of the graph (SVG) instead.")] = False,
    as_json: JsonOption = False,
    launch: Annotated[str | None, typer.Option(hidden=True, help="What a launch file asks for, as JSON.")] = None,
) -> None:
    """Show which ROS nodes and topics a scenario starts.

    For each node of SCENARIO: which topics it subscribes to and publishes, and their message types.

    Example: `fivebar nodes middle`

    Example: `fivebar nodes middle --svg > graph.svg`
    """
    from fivebar_bringup.graph.crossing_graph import crossing_graph
    from fivebar_bringup.graph.drawing import graph_svg
    from fivebar_bringup.scenarios.scenario_files import load_scenario
    from fivebar_description.modules import modules_unopened

    if launch is not None:
        from fivebar_bringup.runs.launched_graph import launched_processes
        from fivebar_bringup.runs.launching import ControlRequest

        with input_errors():
            listed = launched_processes(ControlRequest(**json.loads(launch)))
        print(json.dumps([process._asdict() for process in listed]))
        return
    with input_errors(), nullcontext() if import_law else modules_unopened():
        loaded = load_scenario(scenario)
        if loaded.law_unopened:
            raise InputError(
                f"{scenario}: controller: {loaded.controller!r}: the graph is not known without the module of this"
                " law: expected --import-law, which runs its code"
            )
        if svg and as_json:
            raise InputError("--svg and --json: expected one of them")
        graph = crossing_graph(loaded, Mode.LOCKSTEP, Path("bag"))
    if svg:
        print(graph_svg(graph, f"Nodes and topics of {loaded.name}"), end="")
        return
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
        publishes = [Text.assemble(f"{topic.name} ", (topic.type, "dim")) for topic in node.publishes]
        subscribes = (topic.name for topic in node.subscribes)
        table.add_row(node.executable, node.package, "\n".join(subscribes), Text("\n").join(publishes))
    Printer().print(table)


def _finish(directory: RunDirectory, summary: Summary, as_json: bool) -> NoReturn:
    """Print the outcome and exit with its status."""
    if as_json:
        print(json.dumps(summary.as_dict(), indent=2, allow_nan=False))
    else:
        print_outcome(directory, summary)
    raise typer.Exit(EXIT_STATUS[summary.outcome])
