# SPDX-License-Identifier: Apache-2.0
"""Plans requests in a process of its own, so that a node in real time never waits for a plan.

The process ends when the other end of a pipe closes: when it is no longer wanted, even in the middle of a plan, and
when its parent ends, however that comes about.
"""

from __future__ import annotations

import os
import subprocess
from multiprocessing.connection import Connection, Pipe
from typing import cast

from fivebar_control.planning.orders import Conditions, Order, Planned
from fivebar_description.modules import module_command

WORKER = "fivebar_control.planning.planning_worker"

DEAD = Planned("the planning process has died")


class PlanningProcess:
    """Plans one request at a time; its methods wait for a plan only where they are asked to."""

    def __init__(self, conditions: Conditions, gives_way: bool = False) -> None:
        """Do not start a process before there is a request, or `start`.

        It gives way to other processes where a control cycle follows the clock; in lockstep, time waits for its plans.
        """
        self._conditions = conditions
        self._gives_way = gives_way
        self._process: subprocess.Popen[bytes] | None = None
        self._connection: Connection | None = None
        self._processors = os.sched_getaffinity(0)
        self._number = 0
        self._awaited = False
        self._ready = False

    def start(self) -> None:
        """Start the process before a control cycle runs: that takes some milliseconds, and loading a processor."""
        if self._process is None:
            self._start(at_once=False)

    def _start(self, at_once: bool) -> Connection:
        """Start the process, which gives way, if at all, at once or after it has loaded everything."""
        _leave_priority_to_this_thread()
        # not forked, since a process with threads, as a node is, must not be
        connection, far_end = Pipe()
        self._process = subprocess.Popen(
            [*module_command(WORKER), str(far_end.fileno())],
            stdin=subprocess.DEVNULL,
            pass_fds=(far_end.fileno(),),
            # an interrupt is for the parent, who then ends this process
            start_new_session=True,
        )
        far_end.close()
        self._connection, self._ready = connection, False
        # this thread may have been bound to processors since: the planning stays off them
        connection.send((self._gives_way, at_once, self._processors, self._conditions))
        return connection

    @property
    def pid(self) -> int | None:
        """Its process id, None while there is none."""
        return None if self._process is None else self._process.pid

    def loading(self) -> bool:
        """Return whether the process runs and has not loaded everything yet; returns at once."""
        if self._process is not None and not self._ready:
            self._receive()
        return self._process is not None and not self._ready

    def ask(self, order: Order) -> None:
        """Hand in a request, which takes the place of one under way; returns at once."""
        self._number += 1
        if self._connection is not None:
            try:
                self._connection.send((self._number, order))
            except OSError:
                # the process has died since its last answer
                self.close()
        if self._connection is None:
            # by the clock a cycle is under way, which loading must not disturb either
            self._start(at_once=True).send((self._number, order))
        self._awaited = True

    def answer(self, wait: float = 0.0) -> Planned | None:
        """Return the answer, None while it is not ready; waits for it no longer than asked to (s)."""
        if not self._awaited:
            return None
        planned = self._receive(wait)
        if planned is not None:
            self._awaited = False
        return planned

    def forget(self) -> None:
        """Drop the request under way; the process still answers it, before it takes the next one."""
        self._awaited = False

    def close(self) -> None:
        """End the process, whatever it is doing."""
        process, connection = self._process, self._connection
        self._process = self._connection = None
        self._awaited = self._ready = False
        if connection is not None:
            connection.close()
        if process is not None:
            process.kill()
            process.wait()

    def _receive(self, wait: float = 0.0) -> Planned | None:
        """Return the answer to the present request, if it has come."""
        if self._connection is None:
            return DEAD
        try:
            while self._connection.poll(wait):
                number, planned = self._connection.recv()
                self._ready, wait = True, 0.0
                if number == self._number and planned is not None:
                    return cast(Planned, planned)
        except (EOFError, OSError):
            self.close()
            return DEAD
        return None


def _leave_priority_to_this_thread() -> None:
    """Have processes and threads that this thread starts begin at ordinary priority: it may be a control loop's."""
    policy = os.sched_getscheduler(0)
    if policy in (os.SCHED_FIFO, os.SCHED_RR):
        os.sched_setscheduler(0, policy | os.SCHED_RESET_ON_FORK, os.sched_getparam(0))
