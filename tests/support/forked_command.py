# SPDX-License-Identifier: Apache-2.0
"""The `fivebar` command in a process that has loaded it and all nodes, and forks the nodes of a run from itself.

Every run of the installed command takes seconds of processor time to load modules, twice over; the rest is the same.
"""

from __future__ import annotations

import importlib
import multiprocessing
import os

from forked_node import close_inherited

from fivebar_bringup.cli.main import main as run_command
from fivebar_bringup.runs import node_processes
from fivebar_bringup.runs.node_starter import StartRequest, start

LOADED = (
    "numba",
    "fivebar_bringup.report.gallery",
    "fivebar_bringup.report.report",
    "fivebar_bringup.runs.admission",
    "fivebar_bringup.runs.offline",
    "fivebar_bringup.runs.run",
    "fivebar_bringup.motions.program",
    "fivebar_bringup.motions.stand",
    "fivebar_bringup.motions.transfer_report",
)
"""What commands load in their bodies, beside the nodes."""

for name in LOADED:
    importlib.import_module(name)


def main() -> None:
    """Be the `fivebar` command."""
    node_processes._fork = _fork
    run_command()


def _fork(request: StartRequest, domain: int) -> None:
    """Fork the nodes as their starter does, which is forked from this process, too, while it has no other threads."""
    starter = multiprocessing.get_context("fork").Process(target=_start, args=(request, domain))
    starter.start()
    try:
        starter.join()
    finally:
        starter.kill()
        starter.join()
    if starter.exitcode != 0:
        raise node_processes.NodesNotStarted(f"nodes_not_started: status {starter.exitcode}")


def _start(request: StartRequest, domain: int) -> None:
    os.setsid()
    os.environ["ROS_DOMAIN_ID"] = str(domain)
    # nodes that held the other end of their gate would wait there for ever
    close_inherited(request.reported, request.gate)
    start(request)
