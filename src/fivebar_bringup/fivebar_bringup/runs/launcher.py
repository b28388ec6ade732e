"""Runs the node graph as processes: starts, watches and stops them in order, the recorder last."""

from __future__ import annotations

import ctypes
import math
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, NamedTuple

from fivebar_bringup.nodes.run_monitor import RunMonitor
from fivebar_bringup.runs.graph import BRIDGE, EMULATED_ROBOT, LOCKSTEP_DEADLINE_MS, PLANT, RECORDER, Mode
from fivebar_bringup.runs.process_watch import watch_processes
from fivebar_bringup.runs.processes import ProcessSpec
from fivebar_bringup.runs.run_directory import RunDirectory

POLL_PERIOD = 0.1
STOP_TIMEOUT = 10.0
RECORDER_STOP_TIMEOUT = 20.0

FAULT_TIMEOUT = 2.0 * LOCKSTEP_DEADLINE_MS / 1e3
"""Time (s) for which a run goes on without torque after the death of a node; nodes waiting for it report by then."""

PR_SET_PDEATHSIG = 1

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)

Progress = Callable[[int, int], None]
"""Called with the current sample and the last sample of the run."""


class GraphOutcome(NamedTuple):
    """How a run of the graph ended.

    Attributes:
        wall_s: wall time (s).
        overruns: samples whose torque arrived after the next sample was due, as counted by the plant.
        latency_ms: median, 99th percentile and maximum of the time from a sample to its torque at the plant (ms).
        faults: faults that the launcher detected.
    """

    wall_s: float
    overruns: int | None
    latency_ms: dict[str, float] | None
    faults: list[str]


class Kill(NamedTuple):
    """A process to be killed on purpose, once the run has reached a sample."""

    sample: int
    process: str


class NodeProcess:
    """A process in its own session, so that Ctrl-C in the terminal reaches only the launcher."""

    def __init__(self, process: ProcessSpec, run: RunDirectory, domain: int) -> None:
        """Start the process with its parameter file; its output goes to a log file."""
        self.name = process.name
        parameters = run.parameters / f"{process.name}.yaml"
        parameters.write_text(process.parameter_file(), encoding="utf-8")
        self._log_path = run.logs / f"{process.name}.log"
        with self._log_path.open("wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, *process.command, "--ros-args", "--params-file", str(parameters)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
                start_new_session=True,
                preexec_fn=_prepare_node,
            )

    @property
    def pid(self) -> int:
        """Process id."""
        return self._process.pid

    @property
    def status(self) -> int | None:
        """Exit status, None while the process runs."""
        return self._process.poll()

    def last_line(self) -> str:
        """Return the last line that the node printed."""
        lines = self._log_path.read_text(encoding="utf-8", errors="replace").strip().splitlines()
        return lines[-1] if lines else ""

    def send(self, number: signal.Signals) -> None:
        """Send a signal, if the process still runs."""
        if self.status is None:
            self._process.send_signal(number)

    def wait(self, deadline: float) -> bool:
        """Wait until the process has ended or the deadline (monotonic, s) has passed; return whether it has ended."""
        try:
            self._process.wait(max(0.0, deadline - time.monotonic()))
        except subprocess.TimeoutExpired:
            return False
        return True


def _prepare_node() -> None:
    """Ask the kernel for SIGTERM when the launcher dies, so that even a killed launcher leaves no orphaned node."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    # a process inherits its parent's signal mask
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)


@contextmanager
def _signals_blocked() -> Iterator[None]:
    """Block interrupts while a process is being started, which would otherwise be left running, unknown to us."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def run_graph(
    specs: Sequence[ProcessSpec],
    run: RunDirectory,
    domain: int,
    progress: Progress,
    started: Callable[[Mapping[str, int]], None] = lambda processes: None,
    mode: Mode = Mode.LOCKSTEP,
    kills: Sequence[Kill] = (),
) -> GraphOutcome:
    """Run the graph until its plant has ended, or until KeyboardInterrupt, and stop every node.

    `started` is called once with the id of each process. In real time the end of a process is published as a fault
    immediately; in lockstep time does not advance until the waiting nodes time out. `kills` are processes to kill
    during the run, in order of time.
    """
    run.parameters.mkdir(exist_ok=True)
    run.logs.mkdir(exist_ok=True)
    began = time.monotonic()
    faults: list[str] = []
    processes: dict[str, NodeProcess] = {}
    status: dict[str, Any] = {}
    try:
        # before the monitor: its DDS threads must not exist yet when processes are forked
        for spec in specs:
            with _signals_blocked():
                processes[spec.name] = NodeProcess(spec, run, domain)
        started({name: process.pid for name, process in processes.items()})
        with RunMonitor(domain) as monitor:
            # the plant's regular end is no fault; if it dies, the nodes that wait for its next sample time out
            watched = {
                name: process.pid
                for name, process in processes.items()
                if mode is Mode.REALTIME and name not in (PLANT, EMULATED_ROBOT)
            }
            with watch_processes(watched, monitor.publish_fault):
                _watch(processes, monitor, faults, progress, list(kills))
                status = monitor.status
    except KeyboardInterrupt:
        faults.append("interrupted: stopped by a signal to the launcher")
    finally:
        wall_s = time.monotonic() - began
        faults += stop_all(processes)
    return GraphOutcome(wall_s, status.get("overruns"), status.get("latency_ms"), faults)


def _watch(
    processes: dict[str, NodeProcess], monitor: RunMonitor, faults: list[str], progress: Progress, kills: list[Kill]
) -> None:
    """Follow the run until the plant has ended, or until a node has died and the others have said what they miss."""
    died: set[str] = set()
    last_moment = math.inf
    pace = EMULATED_ROBOT if EMULATED_ROBOT in processes else PLANT
    while processes[pace].status is None:
        monitor.take_one(POLL_PERIOD)
        sample = monitor.status.get("sample", 0)
        if monitor.status:
            progress(sample, monitor.status["samples"])
        while kills and sample >= kills[0].sample:
            processes[kills.pop(0).process].send(signal.SIGKILL)
        for name, process in processes.items():
            if name == pace or name in died or process.status is None:
                continue
            died.add(name)
            faults.append(f"node_died: {name} ended with status {process.status}: {process.last_line()}")
        if died and last_moment == math.inf:
            last_moment = time.monotonic() + (0.0 if RECORDER in died or sample == 0 else FAULT_TIMEOUT)
        if time.monotonic() >= last_moment:
            return
        if pace == EMULATED_ROBOT and monitor.status.get("state", "running") != "running":
            # keep the drives running until the bridge has disabled them
            return
    # the plant's last status may still be in transit
    monitor.take_one(POLL_PERIOD)
    if processes[pace].status not in (0, 1):
        faults.append(f"node_died: {pace} ended with status {processes[pace].status}: {processes[pace].last_line()}")


STOP_ORDER = ((PLANT, BRIDGE), (), (EMULATED_ROBOT,), (RECORDER,))
"""Groups of nodes in the order in which they are stopped; () stands for all others. First the node that produces the
samples, so that stopping the others causes no fault; the drives after their bridge; the recorder last, so that it
records all final messages."""


def stop_all(processes: dict[str, NodeProcess]) -> list[str]:
    """Stop all nodes in order; return what went wrong."""
    named = {name for names in STOP_ORDER for name in names}
    faults = []
    for names in STOP_ORDER:
        group = [process for name, process in processes.items() if (name in names if names else name not in named)]
        faults += _stop(group, RECORDER_STOP_TIMEOUT if RECORDER in names else STOP_TIMEOUT)
    return faults


def _stop(processes: Iterable[NodeProcess], timeout: float) -> list[str]:
    stopping = [process for process in processes if process.status is None]
    for process in stopping:
        process.send(signal.SIGINT)
    deadline = time.monotonic() + timeout
    faults = []
    for process in stopping:
        if not process.wait(deadline):
            process.send(signal.SIGKILL)
            faults.append(f"node_stuck: {process.name} did not stop within {timeout:g} s and was killed")
        elif process.status != 0:
            faults.append(f"node_failed: {process.name} ended with status {process.status}: {process.last_line()}")
    return faults
