# SPDX-License-Identifier: Apache-2.0
"""Starts the node processes of a run: loads what nodes have in common, forks every node from that, and ends.

It is a process of its own because a fork is safe only where there are no threads, and the launcher may have some. What
it loads itself is free of ROS, whose libraries start threads when they are loaded; each node loads those after the
fork. Since the launcher adopts orphans while it waits for this process, the nodes become the launcher's own children.
"""

from __future__ import annotations

import inspect
import json
import os
import signal
import sys
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple, NoReturn

from fivebar_bringup.runs.parent_death import end_with_parent
from fivebar_description.executable import Executable
from fivebar_description.interrupts import STOP_SIGNALS
from fivebar_description.ros.scheduling import spare_what_exists

COMMON_MODULES = (
    "diagnostic_msgs.msg",
    "rcl_interfaces.srv",
    "sensor_msgs.msg",
    "std_msgs.msg",
    "std_srvs.srv",
    "fivebar_bringup.bag.recording",
    "fivebar_control.loop.cycle",
    "fivebar_control.scenario.scenario",
    "fivebar_sim.plant",
)
"""Modules that take most of the time in which a node starts; none of them loads ROS libraries."""

LONGEST_NAME = 15
"""Characters that Linux keeps of the name of a process."""


class NodeCommand(NamedTuple):
    """A node process to be started.

    Attributes:
        name: its name.
        module: the module whose `main` it runs.
        arguments: what follows on its command line.
        log: path of the file for its output.
    """

    name: str
    module: str
    arguments: tuple[str, ...]
    log: str


class StartRequest(NamedTuple):
    """The nodes that are to be started.

    Attributes:
        launcher: process id of the launcher.
        reported: descriptor to write a line "PID NAME" to for each node.
        gate: descriptor from which each node reads one byte before it begins; at the end of file it ends instead.
        nodes: the node processes.
    """

    launcher: int
    reported: int
    gate: int
    nodes: tuple[NodeCommand, ...]

    def as_dict(self) -> dict[str, Any]:
        """Return the request in a form for JSON."""
        return {**self._asdict(), "nodes": [node._asdict() for node in self.nodes]}

    @staticmethod
    def of_dict(content: dict[str, Any]) -> StartRequest:
        """Return the request that `as_dict` has been made of."""
        return StartRequest(**{**content, "nodes": tuple(NodeCommand(**node) for node in content["nodes"])})


def start(request: StartRequest) -> None:
    """Fork the nodes; return in the parent."""
    for module in COMMON_MODULES:
        # what cannot be loaded is reported by the node that needs it
        with suppress(ImportError):
            import_module(module)
    # a look at every module, which a node takes at its start, see `run_nodes`
    inspect.getframeinfo(sys._getframe())
    # memory that the garbage collector leaves alone stays shared among the nodes
    spare_what_exists()
    for node in request.nodes:
        pid = os.fork()
        if pid == 0:
            _run(request, node)
        os.write(request.reported, f"{pid} {node.name}\n".encode())


def _run(request: StartRequest, node: NodeCommand) -> NoReturn:
    """Run a node as `python -m MODULE ARGUMENTS` would, in a session of its own, once the gate opens.

    Signals that ask it to stop are blocked until it handles them, see `Executable`.
    """
    signal.pthread_sigmask(signal.SIG_BLOCK, STOP_SIGNALS)
    os.setsid()
    log = os.open(node.log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC, 0o666)
    for descriptor in (sys.stdout.fileno(), sys.stderr.fileno()):
        os.dup2(log, descriptor)
    Path("/proc/self/comm").write_text(node.name[:LONGEST_NAME], encoding="utf-8")
    opened = os.read(request.gate, 1)
    for descriptor in (log, request.reported, request.gate):
        os.close(descriptor)
    # not before the gate opens: until then the parent is the starter, which ends
    end_with_parent()
    if not opened or os.getppid() != request.launcher:
        os._exit(0)
    sys.argv = [node.module, *node.arguments]
    Executable(node.module)()
    sys.exit(0)


if __name__ == "__main__":
    start(StartRequest.of_dict(json.loads(sys.argv[1])))
