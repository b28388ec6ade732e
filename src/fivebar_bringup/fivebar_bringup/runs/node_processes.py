# SPDX-License-Identifier: Apache-2.0
"""The processes of a run as the launcher holds them: starts them all at once, signals them and waits for them."""

from __future__ import annotations

import ctypes
import json
import os
import select
import signal
import subprocess
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fivebar_bringup.recorded.run_directory import RunDirectory
from fivebar_bringup.runs.node_starter import NodeCommand, StartRequest
from fivebar_bringup.runs.processes import ProcessSpec
from fivebar_description.modules import module_command

STARTER = "fivebar_bringup.runs.node_starter"

PR_SET_CHILD_SUBREAPER = 36

REGULAR = "[INFO]"
"""How a log line begins that reports nothing wrong."""

WAITS, NOT_READY, READY = ": waits for ", "not ready: ", "ready: all inputs are there"
"""Log lines of a node: once it looks for the others, while it lacks some of them, and once it has all."""

PIPE_SIZE = 65536

POLL_PERIOD = 0.01
"""Time (s) between two looks at a process where the system does not tell of its end."""


class NodesNotStarted(Exception):
    """No process of a run has been started; the text says why."""


class NodeProcess:
    """A child process in its own session, so that Ctrl-C in the terminal reaches only the launcher."""

    def __init__(self, name: str, pid: int, log: Path) -> None:
        """Take over a child that nobody has waited for; its output goes to a log file."""
        self.name = name
        self.pid = pid
        self._log = log
        self._status: int | None = None

    @property
    def status(self) -> int | None:
        """Exit status, or the negative number of the signal that ended it; None while the process runs."""
        if self._status is None:
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                self._status = os.waitstatus_to_exitcode(status)
        return self._status

    def how_it_ended(self) -> str:
        """Return the exit status, and what the node printed last, in words."""
        return ": ".join(part for part in (f"ended with status {self.status}", self.last_line()) if part)

    def last_line(self) -> str:
        """Return the last line that the node printed, except those of its regular course; "" where its log is gone."""
        lines = self._text().strip().splitlines()
        lines = [line for line in lines if not line.startswith(REGULAR) and f"]: {NOT_READY}" not in line]
        return lines[-1] if lines else ""

    @property
    def has_begun(self) -> bool:
        """Whether a node of the process looks for the others."""
        return WAITS in self._text()

    def not_ready(self) -> list[str]:
        """Return what the nodes of the process have logged that they lack, those that became ready left out."""
        lacking: dict[str, str] = {}
        for line in self._text().splitlines():
            name, _, text = line.rpartition(" [")[2].partition("]: ")
            if text.startswith(NOT_READY):
                lacking[name] = f"{name}: {text.removeprefix(NOT_READY)}"
            elif text.startswith(READY):
                lacking.pop(name, None)
        return list(lacking.values())

    def _text(self) -> str:
        """Return what the process has printed, "" where its log is gone."""
        try:
            return self._log.read_text(encoding="utf-8", errors="replace")
        except OSError:
            return ""

    def send(self, number: signal.Signals) -> None:
        """Send a signal, if the process still runs."""
        if self.status is None:
            os.kill(self.pid, number)

    def wait(self, deadline: float) -> bool:
        """Wait until the process has ended or the deadline (monotonic, s) has passed; return whether it has ended."""
        if self.status is not None:
            return True
        try:
            descriptor = os.pidfd_open(self.pid)
        except OSError:
            # no more files can be opened, and the process is to be waited for all the same
            while self.status is None and time.monotonic() < deadline:
                time.sleep(POLL_PERIOD)
            return self.status is not None
        try:
            poller = select.poll()
            poller.register(descriptor, select.POLLIN)
            poller.poll(max(0.0, deadline - time.monotonic()) * 1e3)
        finally:
            os.close(descriptor)
        return self.status is not None


def start_processes(
    specs: Sequence[ProcessSpec],
    run: RunDirectory,
    domain: int,
    processes: dict[str, NodeProcess],
    namespace: str = "",
) -> None:
    """Write the parameter file of every process, start them all, and add them to `processes`.

    They begin only when all of them have been added: an interrupt before that leaves none of them running.

    Raises:
        NodesNotStarted: their files cannot be written, or the process that starts them has failed.
    """
    try:
        _start_processes(specs, run, domain, processes, namespace)
    except OSError as error:
        place = f"{error.filename}: " if error.filename else ""
        raise NodesNotStarted(f"nodes_not_started: {place}{error.strerror}") from error


def _start_processes(
    specs: Sequence[ProcessSpec], run: RunDirectory, domain: int, processes: dict[str, NodeProcess], namespace: str
) -> None:
    run.parameters.mkdir(exist_ok=True)
    run.logs.mkdir(exist_ok=True)
    commands = []
    for spec in specs:
        arguments = spec.prepare(run.parameters, namespace)
        commands.append(NodeCommand(spec.name, spec.module, arguments, str(run.logs / f"{spec.name}.log")))
    report, reported = os.pipe()
    gate, release = os.pipe()
    try:
        with _adopting_orphans():
            _fork(StartRequest(os.getpid(), reported, gate, tuple(commands)), domain)
        # the starter has ended, so all its lines are in the pipe
        started = dict(line.split()[::-1] for line in os.read(report, PIPE_SIZE).decode().splitlines())
        for command in commands:
            processes[command.name] = NodeProcess(command.name, int(started[command.name]), Path(command.log))
        os.write(release, bytes(len(commands)))
    finally:
        for descriptor in (report, reported, gate, release):
            os.close(descriptor)


def _fork(request: StartRequest, domain: int) -> None:
    """Have the starter fork the nodes; when this returns, they are children of this process.

    Raises:
        NodesNotStarted: it has failed.
    """
    starter = subprocess.Popen(
        [*module_command(STARTER), json.dumps(request.as_dict())],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.DEVNULL,
        # the starter loads numpy, whose linear algebra otherwise starts threads that a fork does not copy
        env={**os.environ, "ROS_DOMAIN_ID": str(domain), "OPENBLAS_NUM_THREADS": "1"},
        pass_fds=(request.reported, request.gate),
        start_new_session=True,
    )
    try:
        status = starter.wait()
    finally:
        starter.kill()
        starter.wait()
    if status != 0:
        raise NodesNotStarted(f"nodes_not_started: the process that starts them ended with status {status}")


@contextmanager
def _adopting_orphans() -> Iterator[None]:
    """Make processes whose parent ends children of this process, instead of children of the system's first one."""
    libc = ctypes.CDLL(None)
    libc.prctl(PR_SET_CHILD_SUBREAPER, 1)
    try:
        yield
    finally:
        libc.prctl(PR_SET_CHILD_SUBREAPER, 0)
