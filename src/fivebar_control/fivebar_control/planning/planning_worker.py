# SPDX-License-Identifier: Apache-2.0
"""The planning process: answers what comes through the socket whose descriptor is its argument, one after the other."""

from __future__ import annotations

import os
import sys
import threading
from contextlib import suppress
from importlib import import_module
from multiprocessing.connection import Connection
from pathlib import Path
from queue import SimpleQueue
from typing import Any

NICENESS = 10
"""Niceness of the planning process."""


def main() -> None:
    """Plan until the other end closes, in the middle of a plan too."""
    connection = Connection(int(sys.argv[1]))
    gives_way, at_once, processors, conditions = connection.recv()
    with suppress(OSError):
        os.sched_setaffinity(0, processors)
    if gives_way and at_once:
        _give_way()
    orders: SimpleQueue[tuple[int, Any]] = SimpleQueue()
    threading.Thread(target=_take, args=(connection, orders), name="orders", daemon=True).start()
    # this takes a processor for half a second, and a plan for up to several
    from fivebar_control.planning.order_planning import planner_of
    from fivebar_control.planning.orders import Planned

    if conditions.loads.declared:
        # such requests are also tried with the time law of least torque, whose solver takes as long again to load
        import_module("fivebar_control.trajectory.passage_torques")
    try:
        plan = planner_of(conditions)
    except Exception as error:
        # a planner that cannot be loaded refuses every request and must not end the process
        reason = f"planner {conditions.planner}: {error!r}"
        plan = lambda order: Planned(reason)  # noqa: E731
    if gives_way and not at_once:
        _give_way()
    connection.send((0, None))
    while True:
        number, order = orders.get()
        try:
            planned = plan(order)
        except Exception as error:
            # an error of the planner refuses this request and must not end the process
            planned = Planned(f"planning failed: {error!r}")
        with suppress(OSError):
            connection.send((number, planned))


def _give_way() -> None:
    """Let others come first, of other sessions too: the cycle may have no higher priority than any other process."""
    os.nice(NICENESS)
    with suppress(OSError):
        Path("/proc/self/autogroup").write_text(str(NICENESS), encoding="ascii")


def _take(connection: Connection, orders: SimpleQueue[tuple[int, Any]]) -> None:
    """Put what comes into the queue, until the other end closes; then end the process."""
    with suppress(EOFError, OSError):
        while True:
            orders.put(connection.recv())
    os._exit(0)


if __name__ == "__main__":
    main()
