# SPDX-License-Identifier: Apache-2.0
"""Plans requests in a process of its own, so that a node in real time never waits for a plan.

The process ends when the other end of a pipe closes: when it is no longer wanted, even in the middle of a plan, and
when its parent ends, however that comes about.
"""

from __future__ import annotations

import os
import subprocess
import threading
from contextlib import suppress
from multiprocessing.connection import Connection, Pipe
from queue import Empty, SimpleQueue
from typing import Any

from fivebar_control.planning.orders import Conditions, Order, Planned
from fivebar_description.modules import module_command

WORKER = "fivebar_control.planning.planning_worker"

DEAD = Planned("the planning process has died")


class Mailbox:
    """One end of a pipe, whose threads send and receive: long messages take as long as the process needs to read them.

    Objects that come are in `arrived`; None is the last of them, when the other end has closed.
    """

    def __init__(self, connection: Connection) -> None:
        """Send and receive by threads of ordinary priority."""
        self._connection = connection
        self._outgoing: SimpleQueue[Any] = SimpleQueue()
        self.arrived: SimpleQueue[tuple[int, Planned | None] | None] = SimpleQueue()
        for work in (self._send, self._receive):
            threading.Thread(target=work, name="planning", daemon=True).start()

    def send(self, message: Any) -> None:
        """Have a message sent; returns at once."""
        self._outgoing.put(message)

    def close(self) -> None:
        """Send nothing more, and close."""
        self._outgoing.put(None)

    def _send(self) -> None:
        with suppress(OSError):
            while (message := self._outgoing.get()) is not None:
                self._connection.send(message)
        self._connection.close()

    def _receive(self) -> None:
        # a connection that is closed meanwhile has no handle
        with suppress(EOFError, OSError, TypeError):
            while True:
                self.arrived.put(self._connection.recv())
        self.arrived.put(None)


class PlanningProcess:
    """Plans one request at a time; its methods wait for a plan only where they are asked to."""

    def __init__(self, conditions: Conditions, gives_way: bool = False) -> None:
        """Do not start a process before there is a request, or `start`.

        It gives way to other processes where a control cycle follows the clock; in lockstep, time waits for its plans.
        """
        self._conditions = conditions
        self._gives_way = gives_way
        self._process: subprocess.Popen[bytes] | None = None
        self._mailbox: Mailbox | None = None
        self._processors = os.sched_getaffinity(0)
        self._number = 0
        self._awaited = False
        self._ready = False

    def start(self) -> None:
        """Start the process before a control cycle runs: that takes some milliseconds, and loading a processor."""
        if self._process is None:
            self._start(at_once=False)

    def _start(self, at_once: bool) -> Mailbox:
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
        self._mailbox, self._ready = Mailbox(connection), False
        # this thread may have been bound to processors since: the planning stays off them
        self._mailbox.send((self._gives_way, at_once, self._processors, self._conditions))
        return self._mailbox

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
        if self._process is not None and self._process.poll() is not None:
            # it has died since its last answer
            self.close()
        # by the clock a cycle is under way, which loading must not disturb either
        mailbox = self._start(at_once=True) if self._mailbox is None else self._mailbox
        mailbox.send((self._number, order))
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
        process, mailbox = self._process, self._mailbox
        self._process = self._mailbox = None
        self._awaited = self._ready = False
        if mailbox is not None:
            mailbox.close()
        if process is not None:
            process.kill()
            process.wait()

    def _receive(self, wait: float = 0.0) -> Planned | None:
        """Return the answer to the present request, if it has come."""
        if self._mailbox is None:
            return DEAD
        with suppress(Empty):
            while (message := self._mailbox.arrived.get(wait > 0.0, wait or None)) is not None:
                number, planned = message
                self._ready, wait = True, 0.0
                if number == self._number and planned is not None:
                    return planned
            self.close()
            return DEAD
        return None


def _leave_priority_to_this_thread() -> None:
    """Have processes and threads that this thread starts begin at ordinary priority: it may be a control loop's."""
    policy = os.sched_getscheduler(0)
    if policy in (os.SCHED_FIFO, os.SCHED_RR):
        os.sched_setscheduler(0, policy | os.SCHED_RESET_ON_FORK, os.sched_getparam(0))
