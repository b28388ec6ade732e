"""Runs the node graph as processes: starts them, watches them, and stops them in order, the recorder last."""

from __future__ import annotations

import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import NamedTuple

from fivebar_bringup.graph import PLANT, RECORDER, NodeSpec
from fivebar_bringup.nodes.run_monitor import RunMonitor
from fivebar_bringup.run_directory import RunDirectory

POLL_PERIOD = 0.1
STOP_TIMEOUT = 3.0
RECORDER_STOP_TIMEOUT = 20.0

PR_SET_PDEATHSIG = 1

STOP_SIGNALS = (signal.SIGINT, signal.SIGTERM)

Progress = Callable[[int, int], None]
"""Called with the sample reached and the last one's number."""


class GraphOutcome(NamedTuple):
    """How a run of the graph ended: wall time (s), overruns that the plant counted, faults that a launcher sees."""

    wall_s: float
    overruns: int | None
    faults: list[str]


class NodeProcess:
    """One node as a process of its own session, so that a Ctrl-C of the terminal reaches only the launcher."""

    def __init__(self, node: NodeSpec, run: RunDirectory, domain: int) -> None:
        """Start the node with its parameter file; what it prints goes into a log file."""
        self.name = node.executable
        parameters = run.parameters / f"{node.executable}.yaml"
        parameters.write_text(node.parameter_file(), encoding="utf-8")
        self._log_path = run.logs / f"{node.executable}.log"
        with self._log_path.open("wb") as log:
            self._process = subprocess.Popen(
                [sys.executable, "-m", node.module, "--ros-args", "--params-file", str(parameters)],
                stdin=subprocess.DEVNULL,
                stdout=log,
                stderr=subprocess.STDOUT,
                env={**os.environ, "ROS_DOMAIN_ID": str(domain)},
                start_new_session=True,
                preexec_fn=_prepare_node,
            )

    @property
    def pid(self) -> int:
        """Process number."""
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
    """Ask the kernel for SIGTERM when the launcher dies, so that even a killed launcher leaves no node behind."""
    ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGTERM)
    # a process inherits what its parent holds back
    signal.pthread_sigmask(signal.SIG_UNBLOCK, STOP_SIGNALS)


@contextmanager
def _signals_held_back() -> Iterator[None]:
    """Let an interrupt wait: in the middle of the start of a process it would leave one that nobody knows of."""
    before = signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def run_graph(
    nodes: Sequence[NodeSpec],
    run: RunDirectory,
    domain: int,
    progress: Progress,
    started: Callable[[Mapping[str, int]], None] = lambda processes: None,
) -> GraphOutcome:
    """Run the graph until its plant has ended, or until KeyboardInterrupt, and stop every node.

    `started` is called once with the process number of each node.
    """
    run.parameters.mkdir(exist_ok=True)
    run.logs.mkdir(exist_ok=True)
    began = time.monotonic()
    faults: list[str] = []
    processes: dict[str, NodeProcess] = {}
    status: dict[str, int] = {}
    try:
        # before the monitor: its DDS threads must not be there yet when processes are forked
        for node in nodes:
            with _signals_held_back():
                processes[node.executable] = NodeProcess(node, run, domain)
        started({name: process.pid for name, process in processes.items()})
        with RunMonitor(domain) as monitor:
            _watch(processes, monitor, faults, progress)
            status = monitor.status
    except KeyboardInterrupt:
        faults.append("interrupted: stopped by a signal to the launcher")
    finally:
        wall_s = time.monotonic() - began
        faults += stop_all(processes)
    return GraphOutcome(wall_s, status.get("overruns"), faults)


def _watch(processes: dict[str, NodeProcess], monitor: RunMonitor, faults: list[str], progress: Progress) -> None:
    """Follow the run until the plant has ended, or until a node has died without which there is nothing to wait for."""
    died: set[str] = set()
    while processes[PLANT].status is None:
        monitor.wait(POLL_PERIOD)
        if monitor.status:
            progress(monitor.status["sample"], monitor.status["samples"])
        for name, process in processes.items():
            if name == PLANT or name in died or process.status is None:
                continue
            died.add(name)
            faults.append(f"node_died: {name} ended with status {process.status}: {process.last_line()}")
        started = monitor.status.get("sample", 0) > 0
        if died and (RECORDER in died or not started):
            return
    # the last word of the plant may still be on its way
    monitor.wait(POLL_PERIOD)
    if processes[PLANT].status not in (0, 1):
        faults.append(f"node_died: {PLANT} ended with status {processes[PLANT].status}: {processes[PLANT].last_line()}")


def stop_all(processes: dict[str, NodeProcess]) -> list[str]:
    """Stop all nodes, the recorder last so that it hears the others' last words; return what went wrong."""
    recorders = [process for name, process in processes.items() if name == RECORDER]
    others = [process for name, process in processes.items() if name != RECORDER]
    return [*_stop(others, STOP_TIMEOUT), *_stop(recorders, RECORDER_STOP_TIMEOUT)]


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
