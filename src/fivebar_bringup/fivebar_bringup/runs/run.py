# SPDX-License-Identifier: Apache-2.0
"""A run with the node graph, from scenario to report."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from typing import NamedTuple

from fivebar_bringup.drives.choice import RealDrives, write_drive_files, write_real_drives
from fivebar_bringup.drives.run_files import Rehearsal
from fivebar_bringup.errors import BagError
from fivebar_bringup.graph.crossing_graph import Bridged, crossing_graph
from fivebar_bringup.graph.node_spec import Mode, Sharing
from fivebar_bringup.recorded.outcome import RECORDING_FAILED
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory, write_timing
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.report.report import write_report, write_summary_without_bag
from fivebar_bringup.runs.domain import private_domain
from fivebar_bringup.runs.injection import Injection, kills
from fivebar_bringup.runs.launcher import INTERRUPTED, GraphOutcome, RunOptions, run_graph
from fivebar_bringup.runs.machine_code import compile_for
from fivebar_bringup.runs.processes import ProcessSpec, processes
from fivebar_bringup.scenario import Scenario
from fivebar_control.scenario.stopping import stop_cycles
from fivebar_description.interrupts import interrupts_allowed, interrupts_deferred
from fivebar_description.ros.scheduling import Scheduling


class Rehearsed(NamedTuple):
    """A rehearsal: faults to be injected, and the name of the configuration with which the bridge's begins."""

    faults: Sequence[Injection] = ()
    configuration: str | None = None


def run_with_ros(
    scenario: Scenario,
    options: RunOptions,
    drives: Rehearsed | RealDrives | None = None,
    scheduling: Scheduling | None = None,
    sharing: Sharing | None = None,
    scene: bool = False,
) -> tuple[RunDirectory, Summary]:
    """Run a scenario with the node graph as processes.

    Bridge and drives, emulated or real, replace the plant where some are given. With `scene`, pictures of the run are
    published and recorded too.

    Raises:
        InputError: the motion is refused, the scenario cannot be rehearsed, or the output directory cannot be used.
    """

    def specs() -> Sequence[ProcessSpec]:
        bridge: Rehearsal | Bridged | None = None
        if isinstance(drives, RealDrives):
            file = run.path / "drives.yaml"
            write_real_drives(scenario, drives, file)
            bridge = Bridged(str(file.absolute()), drives.activate)
        elif drives is not None:
            drive_faults = tuple(str(injection) for injection in drives.faults if injection.victim is None)
            bridge = Rehearsal(write_drive_files(scenario, run.path, drives.configuration), drive_faults)
        nodes = crossing_graph(scenario, options.mode, run.bag, bridge, scene)
        return processes(nodes, options.mode, scenario.rate_hz, scheduling, sharing)

    def follow(specs: Sequence[ProcessSpec], chosen: int) -> GraphOutcome:
        injected = drives.faults if isinstance(drives, Rehearsed) else ()
        return run_graph(specs, run, chosen, options, kills(injected, specs, scenario.rate_hz))

    with interrupts_deferred():
        run = new_run_directory(options.out, scenario, options.odds)
        outcome = run_prepared(scenario, options, specs, follow)
        return run, report_on(run, scenario, options.mode, outcome, options.with_page)


def run_prepared(
    scenario: Scenario,
    options: RunOptions,
    specs: Callable[[], Sequence[ProcessSpec]],
    follow: Callable[[Sequence[ProcessSpec], int], GraphOutcome],
    finds_odds: bool = False,
) -> GraphOutcome:
    """Prepare a run of the graph and follow it, in a block that defers interrupts; return how it ended.

    Interrupted while machine code is compiled or the processes are described, it ends before it has begun.

    Args:
        scenario: what is run.
        options: how.
        specs: describes the processes, and writes what files they need.
        follow: runs these processes in a domain.
        finds_odds: whether requests are planned by their odds.
    """
    began = time.monotonic()
    try:
        with interrupts_allowed():
            compile_for(scenario, options.mode, finds_odds)
            described = specs()
    except KeyboardInterrupt:
        return GraphOutcome(time.monotonic() - began, None, None, [INTERRUPTED])
    with private_domain() if options.domain is None else nullcontext(options.domain) as chosen:
        return follow(described, chosen)


def report_on(run: RunDirectory, scenario: Scenario, mode: Mode, outcome: GraphOutcome, with_page: bool) -> Summary:
    """Keep how a run of the graph ended, and write the report of what it has recorded.

    A bag that cannot be read is a fault of the run, whose summary then tells of no sample.

    Raises:
        InputError: the directory cannot be written to.
    """
    write_outcome(run, scenario, mode, outcome)
    try:
        return write_report(run, with_page)
    except BagError as error:
        # where nothing has begun, there is no bag, and the reason is known
        if not (outcome.faults and not run.bag.exists()):
            faults = [*outcome.faults, f"{RECORDING_FAILED}: {error}"]
            write_outcome(run, scenario, mode, outcome._replace(faults=faults))
        return write_summary_without_bag(run)


def write_outcome(run: RunDirectory, scenario: Scenario, mode: Mode, outcome: GraphOutcome) -> None:
    """Keep how a run of the graph ended with its results."""
    write_timing(
        run,
        {
            "runner": "ros",
            "mode": mode.value,
            "wall_s": outcome.wall_s,
            "overruns": outcome.overruns if mode is Mode.REALTIME else None,
            "latency_ms": outcome.latency_ms,
            "stop_cycles": stop_cycles(scenario) if mode is Mode.REALTIME else None,
            "faults": [*outcome.published, *outcome.faults],
        },
    )
