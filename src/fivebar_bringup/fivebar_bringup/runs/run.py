# SPDX-License-Identifier: Apache-2.0
"""A run with the node graph, from scenario to report."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from contextlib import nullcontext
from pathlib import Path
from typing import Any

from fivebar_bringup.drives.choice import RealDrives, write_drive_files, write_real_drives
from fivebar_bringup.drives.run_files import Rehearsal
from fivebar_bringup.errors import BagError
from fivebar_bringup.graph.crossing_graph import crossing_graph
from fivebar_bringup.graph.node_spec import Mode, Sharing
from fivebar_bringup.recorded.outcome import RECORDING_FAILED
from fivebar_bringup.recorded.run_directory import RunDirectory, new_run_directory, write_timing
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.report.report import write_report, write_summary_without_bag
from fivebar_bringup.runs.domain import private_domain
from fivebar_bringup.runs.injection import Injection, kills
from fivebar_bringup.runs.launcher import INTERRUPTED, GraphOutcome, Progress, run_graph
from fivebar_bringup.runs.machine_code import compile_for
from fivebar_bringup.runs.processes import ProcessSpec, processes
from fivebar_bringup.scenario import Scenario
from fivebar_control.scenario.stopping import stop_cycles
from fivebar_description.interrupts import interrupts_allowed, interrupts_deferred
from fivebar_description.ros.scheduling import Scheduling


def run_with_ros(
    scenario: Scenario,
    mode: Mode,
    out: Path | None,
    domain: int | None,
    progress: Progress,
    scheduling: Scheduling | None = None,
    sharing: Sharing | None = None,
    rehearse: Sequence[Injection] | None = None,
    with_page: bool = True,
    scene: bool = False,
    namespace: str = "",
    configuration: str | None = None,
    real: RealDrives | None = None,
    odds: Mapping[str, Any] | None = None,
) -> tuple[RunDirectory, Summary]:
    """Run a scenario with the node graph as processes, in a private DDS domain unless one is given.

    With `rehearse`, bridge and emulated drives replace the plant and these faults are injected; None for the plant.
    The bridge's configuration begins as the named one. With `real`, real drives do.
    With `scene`, pictures of the run are published and recorded too. A namespace lets several robots share a domain.
    The odds of its motion, where they are known, are kept with the run.

    Raises:
        InputError: the motion is refused, the scenario cannot be rehearsed, or the output directory cannot be used.
    """

    def specs() -> Sequence[ProcessSpec]:
        rehearsal = drives = None
        if real is not None:
            drives = run.path / "drives.yaml"
            write_real_drives(scenario, real, drives)
        elif rehearse is not None:
            drive_faults = tuple(str(injection) for injection in rehearse if injection.victim is None)
            rehearsal = Rehearsal(write_drive_files(scenario, run.path, configuration), drive_faults)
        nodes = crossing_graph(
            scenario,
            mode,
            run.bag,
            rehearsal,
            str(drives.absolute()) if drives else None,
            scene,
            activate=real is not None and real.activate,
        )
        return processes(nodes, mode, scenario.rate_hz, scheduling, sharing)

    def follow(specs: Sequence[ProcessSpec], chosen: int) -> GraphOutcome:
        to_kill = kills(rehearse or (), specs, scenario.rate_hz)
        return run_graph(specs, run, chosen, progress, mode=mode, kills=to_kill, namespace=namespace)

    with interrupts_deferred():
        run = new_run_directory(out, scenario, odds)
        outcome = run_prepared(scenario, mode, domain, specs, follow)
        return run, report_on(run, scenario, mode, outcome, with_page)


def run_prepared(
    scenario: Scenario,
    mode: Mode,
    domain: int | None,
    specs: Callable[[], Sequence[ProcessSpec]],
    follow: Callable[[Sequence[ProcessSpec], int], GraphOutcome],
    finds_odds: bool = False,
) -> GraphOutcome:
    """Prepare a run of the graph and follow it, in a block that defers interrupts; return how it ended.

    Interrupted while machine code is compiled or the processes are described, it ends before it has begun.

    Args:
        scenario: what is run.
        mode: in lockstep or by the clock.
        domain: DDS domain, a private one by default.
        specs: describes the processes, and writes what files they need.
        follow: runs these processes in a domain.
        finds_odds: whether requests are planned by their odds.
    """
    began = time.monotonic()
    try:
        with interrupts_allowed():
            compile_for(scenario, mode, finds_odds)
            described = specs()
    except KeyboardInterrupt:
        return GraphOutcome(time.monotonic() - began, None, None, [INTERRUPTED])
    with nullcontext(domain) if domain is not None else private_domain() as chosen:
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
