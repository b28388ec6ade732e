# SPDX-License-Identifier: Apache-2.0
"""Runs the node graph as processes: starts, watches and stops them in order, the recorder last."""

from __future__ import annotations

import math
import os
import signal
import sys
import time
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, NamedTuple

from fivebar_bringup.bag import RECORDER
from fivebar_bringup.graph.node_spec import BRIDGES, EMULATED_ROBOT, PLANT, SCENE_NODE, Mode
from fivebar_bringup.recorded.outcome import INTERRUPTED_FAULT, RECORDING_FAILED
from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.runs.node_processes import NodeProcess, NodesNotStarted, start_processes
from fivebar_bringup.runs.process_watch import watch_processes
from fivebar_bringup.runs.processes import ProcessSpec
from fivebar_description.interrupts import interrupts_allowed, interrupts_deferred
from fivebar_description.network import discovery_hint

if TYPE_CHECKING:
    from fivebar_bringup.nodes.run_monitor import RunMonitor

POLL_PERIOD = 0.1
STOP_TIMEOUT = 15.0
"""Time (s) in which a node must have stopped; longer than it takes to deliver its last messages and to shut down."""

RECORDER_STOP_TIMEOUT = 60.0
"""The same for the recorder, from the last time that its bag has grown: it first writes what it has received, which may
be much on a busy machine."""

PROGRESS_PERIOD = 1.0
"""Time (s) between two looks at whether a node that is stopping still works."""

ABORT_TIMEOUT = 2.0

FAULT_TIMEOUT = 8.0
"""Longest time (s) that a run goes on after the death of a node, until a fault has been published; longer than the
plant waits for a torque."""

BRIDGE_TIMEOUT = 15.0
"""Longest time (s) without a word of the bridge once a fault has stopped the robot; it says every fifth of a second how
far the run is, except while it opens its drives anew."""

LAST_FAULT_TIMEOUT = 1.0
"""Time (s) in which the fault is heard of a plant that has ended by one."""

SILENCE = 6.0
"""Time (s) within which a node is heard that looks for the others; discovery takes a tenth of it."""

MISSING = "nodes_missing"

INTERRUPTED = f"{INTERRUPTED_FAULT}: stopped by a signal to the launcher"

Progress = Callable[[int, int], None]
"""Called with the current sample and the last sample of the run."""


class GraphOutcome(NamedTuple):
    """How a run of the graph ended.

    Attributes:
        wall_s: wall time (s).
        overruns: samples whose torque arrived after the next sample was due, as counted by the plant.
        latency_ms: median, 99th percentile and maximum of the time from a sample to its torque at plant or drives (ms).
        faults: faults that the launcher detected.
        published: faults that nodes had published and that the bag may lack: all of them where a signal ended the run,
            else that it could not be written.
    """

    wall_s: float
    overruns: int | None
    latency_ms: dict[str, float] | None
    faults: list[str]
    published: Sequence[str] = ()


class Kill(NamedTuple):
    """A process to be killed on purpose, once the run has reached a sample."""

    sample: int
    process: str


class RunOptions(NamedTuple):
    """How a scenario is run with the node graph.

    Attributes:
        mode: in lockstep or by the clock.
        out: directory of the run, None for a new one below `runs`.
        domain: DDS domain, None for a private one.
        progress: called with the current and the last sample.
        namespace: of all nodes, so that several robots can share a domain.
        with_page: whether the report has a page.
        odds: of the motion, where they are known, which are kept with the run.
    """

    mode: Mode
    out: Path | None = None
    domain: int | None = None
    progress: Progress = lambda sample, last: None
    namespace: str = ""
    with_page: bool = True
    odds: Mapping[str, Any] | None = None


def run_graph(
    specs: Sequence[ProcessSpec],
    run: RunDirectory,
    domain: int,
    options: RunOptions,
    kills: Sequence[Kill] = (),
    followed: Callable[[Mapping[str, Any]], bool] = lambda program: False,
    started: Callable[[Mapping[str, int]], None] = lambda processes: None,
) -> GraphOutcome:
    """Run the graph until its plant has ended, or until KeyboardInterrupt, and stop every node.

    Only the start and the motion are interrupted: the nodes are then stopped in order, however many signals come.

    In real time the end of a process is published as a fault immediately; in lockstep time does not advance until the
    waiting nodes time out. `kills` are processes to kill during the run, in order of time. `followed` gets the status
    of the program that is carried out, and says whether the run is over with it. `started` is called once with the id
    of each process.
    """
    # here, because it loads ROS
    from fivebar_bringup.nodes.run_monitor import RunMonitor

    began = time.monotonic()
    faults: list[str] = []
    heard: list[str] = []
    published: list[str] = []
    processes: dict[str, NodeProcess] = {}
    status: dict[str, Any] = {}
    latency: dict[str, float] | None = None
    with interrupts_deferred():
        try:
            with interrupts_allowed():
                start_processes(specs, run, domain, processes, options.namespace)
                started({name: process.pid for name, process in processes.items()})
            own = {process.pid for process in processes.values()}
            with RunMonitor(domain, options.namespace, own) as monitor:
                heard = monitor.faults
                # the plant's regular end is no fault; if it dies, the nodes that wait for its next sample time out. A
                # run goes on without its pictures
                watched = {
                    name: process.pid
                    for name, process in processes.items()
                    if options.mode is Mode.REALTIME and name not in (PLANT, EMULATED_ROBOT, SCENE_NODE)
                }
                silence = _Silence(processes, monitor, domain)
                try:
                    with watch_processes(watched, monitor.publish_fault), interrupts_allowed():
                        _watch(processes, monitor, faults, options.progress, list(kills), followed, silence)
                except KeyboardInterrupt:
                    # a fault that had stopped the robot before the signal may still be in transit
                    monitor.take_for(POLL_PERIOD)
                    raise
                status = monitor.status
                latency = status.get("latency_ms") or monitor.bridge_latency
            # a full disk has no room for it in the bag
            published = [fault for fault in heard if fault.startswith(RECORDING_FAILED)]
            if any(fault.startswith(MISSING) for fault in monitor.faults):
                faults += _lacking(processes)
        except NodesNotStarted as error:
            faults.append(str(error))
        except KeyboardInterrupt:
            published = list(heard)
            faults.append(INTERRUPTED)
        finally:
            wall_s = time.monotonic() - began
            faults += stop_all(processes, run.bag)
    return GraphOutcome(wall_s, status.get("overruns"), latency, faults, published)


def _watch(
    processes: dict[str, NodeProcess],
    monitor: RunMonitor,
    faults: list[str],
    progress: Progress,
    kills: list[Kill],
    followed: Callable[[Mapping[str, Any]], bool],
    silence: _Silence,
) -> None:
    """Follow the run until plant or motion has ended, or until a node has died and a fault has been published."""
    died: set[str] = set()
    last_moment = math.inf
    pace = _pace_of(processes)
    told: set[str] = set()
    while processes[pace].status is None:
        monitor.take_one(POLL_PERIOD)
        sample = monitor.status.get("sample", 0)
        if pace in BRIDGES and sample == 0:
            # there may be no end to waiting for a sensor, or for the operator, who wants to know
            new = [reason for reason in _lacking(processes) if reason not in told]
            told.update(new)
            for text in new:
                print(f"fivebar: {text}", file=sys.stderr)
        if monitor.status:
            progress(sample, monitor.status["samples"])
        if followed(monitor.program):
            return
        unheard = silence.fault()
        if unheard is not None:
            faults.append(unheard)
            return
        while kills and sample >= kills[0].sample:
            processes[kills.pop(0).process].send(signal.SIGKILL)
        for name, process in processes.items():
            if name in (pace, SCENE_NODE) or name in died or process.status is None:
                continue
            died.add(name)
            faults.append(f"node_died: {name} {process.how_it_ended()}")
        if died and last_moment == math.inf:
            last_moment = time.monotonic() + (0.0 if RECORDER in died or sample == 0 else FAULT_TIMEOUT)
        if time.monotonic() >= last_moment or (died and monitor.faults):
            return
        if pace != PLANT and monitor.status.get("state", "running") != "running":
            # keep the drives running until the bridge has disabled them
            return
    # the plant's last status and its fault may still be in transit
    monitor.take_one(POLL_PERIOD)
    if processes[pace].status not in (0, 1) or (
        processes[pace].status == 1 and not monitor.wait_for(lambda: monitor.faults, LAST_FAULT_TIMEOUT)
    ):
        faults.append(f"node_died: {pace} {processes[pace].how_it_ended()}")


def _lacking(processes: Mapping[str, NodeProcess]) -> list[str]:
    """Return what the nodes of a run lack before they are ready, as faults."""
    return [f"{MISSING}: {reason}" for process in processes.values() for reason in process.not_ready()]


def _pace_of(processes: Collection[str]) -> str:
    """Return the node whose end is that of the run; on real drives the bridge, which publishes the run's progress."""
    return next(name for name in (EMULATED_ROBOT, PLANT, *BRIDGES) if name in processes)


class _Silence:
    """Notices that nodes of a run cannot be heard: any at its beginning, and a bridge once there is a fault."""

    def __init__(self, processes: Mapping[str, NodeProcess], monitor: RunMonitor, domain: int) -> None:
        self._processes = processes
        self._monitor = monitor
        self._domain = domain
        self._heard = False
        self._since: float | None = None
        self._pace = _pace_of(processes)
        self._status, self._told = monitor.status, time.monotonic()

    def fault(self) -> str | None:
        """Return the fault once what has begun has not been heard for some time."""
        now = time.monotonic()
        if self._monitor.status is not self._status:
            self._status, self._told = self._monitor.status, now
        if self._pace in BRIDGES and self._status and self._monitor.faults and now - self._told > BRIDGE_TIMEOUT:
            return f"node_stuck: {self._pace} has not been heard for {BRIDGE_TIMEOUT:g} s"
        self._heard = self._heard or bool(self._monitor.status) or self._monitor.sees_nodes()
        if self._heard or not all(process.has_begun for process in self._processes.values()):
            return None
        self._since = self._since if self._since is not None else now
        if now - self._since < SILENCE:
            return None
        return f"{MISSING}: no node of the run is heard: {discovery_hint(self._domain)}"


STOP_ORDER = ((PLANT, *BRIDGES), (), (EMULATED_ROBOT,), (RECORDER,))
"""Groups of nodes in the order in which they are stopped; () stands for all others. First the node that produces the
samples, so that stopping the others causes no fault; the drives after their bridge; the recorder last, so that it
records all final messages."""


def stop_all(processes: dict[str, NodeProcess], bag: Path) -> list[str]:
    """Stop all nodes in order, the recorder once its bag grows no more; return what went wrong."""
    named = {name for names in STOP_ORDER for name in names}
    faults = []
    for names in STOP_ORDER:
        group = [process for name, process in processes.items() if (name in names if names else name not in named)]
        if RECORDER in names:
            faults += _stop(group, RECORDER_STOP_TIMEOUT, lambda: _size(bag))
        else:
            faults += _stop(group, STOP_TIMEOUT)
    return faults


def _stop(processes: Iterable[NodeProcess], timeout: float, progress: Callable[[], int] = lambda: 0) -> list[str]:
    """Stop processes that may take some time (s), from the last change of their progress on."""
    stopping = [process for process in processes if process.status is None]
    for process in stopping:
        process.send(signal.SIGINT)
    deadline, seen = time.monotonic() + timeout, progress()
    faults = []
    for process in stopping:
        while not process.wait(min(deadline, time.monotonic() + PROGRESS_PERIOD)):
            if (now := progress()) != seen:
                deadline, seen = time.monotonic() + timeout, now
            if time.monotonic() >= deadline:
                break
        if process.status is None:
            # on SIGABRT a node writes to its log where each of its threads is
            process.send(signal.SIGABRT)
            if not process.wait(time.monotonic() + ABORT_TIMEOUT):
                process.send(signal.SIGKILL)
            faults.append(f"node_stuck: {process.name} did not stop within {timeout:g} s and was killed, see its log")
        elif process.status != 0:
            faults.append(f"node_failed: {process.name} {process.how_it_ended()}")
    return faults


def _size(folder: Path) -> int:
    """Return how many bytes the files of a folder have; 0 where it is gone."""
    try:
        return sum(entry.stat().st_size for entry in os.scandir(folder))
    except OSError:
        return 0
