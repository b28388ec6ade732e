# SPDX-License-Identifier: Apache-2.0
"""The speed of the node graph in lockstep, and of a bare ring of nodes with as many hops."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from cycle_costs import CycleCosts, WatchedGroup, costs_file, importable, read_costs
from fivebar_bringup.bag import RECORDER
from fivebar_bringup.bag.reader import read_bag
from fivebar_bringup.drives.choice import write_drive_files
from fivebar_bringup.drives.run_files import Rehearsal
from fivebar_bringup.graph.crossing_graph import crossing_graph
from fivebar_bringup.graph.node_spec import Mode, Sharing
from fivebar_bringup.recorded.run_directory import new_run_directory
from fivebar_bringup.recorded.summary import Summary
from fivebar_bringup.report.report import write_report
from fivebar_bringup.runs.domain import private_domain
from fivebar_bringup.runs.launcher import RunOptions, run_graph
from fivebar_bringup.runs.machine_code import compile_for
from fivebar_bringup.runs.processes import CONTROLLERS, processes
from fivebar_bringup.runs.run import write_outcome
from fivebar_bringup.scenario import Scenario
from fivebar_description.interface import DEFAULT_PRIORITY, FAULTS, JOINT_STATES, NANOSECONDS
from fivebar_description.ros.scheduling import Scheduling
from stalls import LateBeat, bare_loop_beside, missed_by_both

IntArray = NDArray[np.int64]

HOPS = 3
"""Hops of one cycle: plant to controllers, controllers to blender, blender to plant."""

RING_DEADLINE = 120.0

BARE_CHAIN = Path(__file__).with_name("bare_chain.py")
"""Script that runs a node of the bare ring."""


class GraphSpeed(NamedTuple):
    """The time and the processor time of a run of the graph.

    Attributes:
        cycle_p50_ms, cycle_p99_ms: times between two samples (ms).
        realtime_factor: simulated seconds per second.
        missed: samples whose torque came too late, in real time.
        latency_ms: median, 99th percentile and maximum from a sample to its torque at plant or drives (ms).
        cpu_ms: processor time of each process per cycle (ms), DDS included.
        faults: what went wrong.
        periods_ms: times from one recorded sample to the next (ms).
        summary: of the run's report.
        costs: what a cycle of the control chain is made of, where that was asked for.
        missing: samples between the first and the last one that were not recorded.
        missed_too: how many of them a bare loop beside the run missed too, None where there was none.
    """

    cycle_p50_ms: float
    cycle_p99_ms: float
    realtime_factor: float
    missed: int | None
    latency_ms: dict[str, float] | None
    cpu_ms: dict[str, float]
    faults: list[str]
    periods_ms: list[float]
    summary: Summary | None = None
    costs: CycleCosts | None = None
    missing: int = 0
    missed_too: int | None = None


def graph_speed(
    scenario: Scenario,
    mode: Mode,
    rehearsed: bool = False,
    sharing: Sharing | None = None,
    itemised: bool = False,
    beside: bool = False,
) -> GraphSpeed:
    """Run a scenario with the node graph, as `fivebar run` does, and measure it.

    Args:
        scenario: what to run.
        mode: in lockstep or in real time.
        rehearsed: over the bridge and emulated drives, which is always in real time.
        sharing: which nodes share a process; None as in a run.
        itemised: whether the cycles of nodes that share a process are itemised, which takes time in each.
        beside: whether a bare loop runs beside it.

    Raises:
        BagError: the run left no bag with samples.
    """
    looks: list[tuple[int, dict[str, float]]] = []
    pids: Mapping[str, int] = {}

    def started(numbers: Mapping[str, int]) -> None:
        nonlocal pids
        pids = numbers

    def look(sample: int, last: int) -> None:
        if 0 < sample < last:
            looks.append((sample, {name: _cpu_seconds(pid) for name, pid in pids.items()}))

    with tempfile.TemporaryDirectory() as folder, private_domain() as domain:
        run = new_run_directory(Path(folder), scenario)
        compile_for(scenario, mode)
        rehearsal = Rehearsal(write_drive_files(scenario, run.path), ()) if rehearsed else None
        nodes = crossing_graph(scenario, mode, run.bag, rehearsal)
        # also in lockstep by the clock: how quick the graph is shows in these times alone
        by_clock = {"simulated_time": False}
        nodes = tuple(
            node._replace(parameters={**node.parameters, **by_clock}) if node.executable == RECORDER else node
            for node in nodes
        )
        specs = processes(nodes, mode, scenario.rate_hz, Scheduling(DEFAULT_PRIORITY), sharing)
        if itemised:
            specs = tuple(WatchedGroup(*spec) for spec in specs)
        loop: AbstractContextManager[list[LateBeat]] = nullcontext([])
        if beside:
            loop = bare_loop_beside(scenario.rate_hz)
        with importable() if itemised else nullcontext(), loop as stalls:
            outcome = run_graph(specs, run, domain, RunOptions(mode, progress=look), started=started)
        write_outcome(run, scenario, mode, outcome)
        summary = write_report(run, with_page=False)
        bag = read_bag(run.bag)
        times = np.diff(bag.log_times(JOINT_STATES)) / 1e6
        missing = missing_stamps(bag.stamps(JOINT_STATES), scenario.rate_hz)
        faults = [*outcome.faults, *(bag.texts(FAULTS) if bag.count(FAULTS) else ())]
        costs = read_costs(costs_file(run.parameters / f"{CONTROLLERS}.yaml")) if itemised else None
    return GraphSpeed(
        float(np.percentile(times, 50)),
        float(np.percentile(times, 99)),
        1e3 / scenario.rate_hz / float(np.mean(times)),
        outcome.overruns,
        outcome.latency_ms,
        _cpu_per_cycle(looks),
        faults,
        times.tolist(),
        summary,
        costs,
        len(missing),
        missed_by_both(missing, stalls, NANOSECONDS // scenario.rate_hz) if beside else None,
    )


def missing_stamps(stamps: Sequence[int] | IntArray, rate_hz: int) -> list[int]:
    """Return the stamps (ns) of the samples that are missing between the first and the last of some."""
    period, there = NANOSECONDS // rate_hz, sorted({int(one) for one in stamps})
    gaps = pairwise(there)
    return [stamp for one, next_one in gaps for stamp in range(one + period, next_one, period)]


def _cpu_per_cycle(looks: Sequence[tuple[int, dict[str, float]]]) -> dict[str, float]:
    """Return the processor time (ms) of each process per cycle between two looks; none of a run that was too short."""
    if len(looks) < 2 or looks[-1][0] == looks[0][0]:
        return {}
    (first, before), (last, after) = looks[0], looks[-1]
    return {name: (after[name] - before[name]) / (last - first) * 1e3 for name in before}


def bare_chain_p50_ms(rounds: int = 2000) -> float:
    """Return the median time (ms) in which a message goes round a bare ring of `HOPS` nodes."""
    with private_domain() as domain:
        nodes = [_ring_node(position, rounds, domain) for position in range(HOPS)]
        try:
            output, _ = nodes[0].communicate(timeout=RING_DEADLINE)
        finally:
            for node in nodes:
                node.terminate()
            for node in nodes:
                node.wait()
    times: dict[str, Any] = json.loads(output.splitlines()[-1])
    return float(times["p50"])


def _ring_node(position: int, rounds: int, domain: int) -> subprocess.Popen[str]:
    parameters = {"position": position, "hops": HOPS, "rounds": rounds}
    assignments = [word for name, value in parameters.items() for word in ("-p", f"{name}:={value}")]
    remap = ["-r", f"__node:=bare_chain_{position}"]
    return subprocess.Popen(
        [sys.executable, str(BARE_CHAIN), "--ros-args", *assignments, *remap],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
    )


def _cpu_seconds(pid: int) -> float:
    """Return the processor time (s) of a process so far, all its threads, user and system."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


def stamp() -> str:
    """Return when this was measured."""
    return time.strftime("%Y-%m-%d %H:%M:%S")
