"""Announces the death of a process within milliseconds, so that the robot does not wait for anybody to look."""

from __future__ import annotations

import os
import select
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager


@contextmanager
def deaths_announced(processes: Mapping[str, int], announce: Callable[[str], None]) -> Iterator[None]:
    """While in the context, call `announce` in a thread with the fault's text for every process that ends.

    `processes` are process numbers by name; one that has ended already is announced, too.
    """
    wake_read, wake_write = os.pipe()
    names = {os.pidfd_open(number): name for name, number in processes.items()}
    poller = select.poll()
    for descriptor in (wake_read, *names):
        poller.register(descriptor, select.POLLIN)

    def watch() -> None:
        while True:
            for descriptor, _ in poller.poll():
                if descriptor == wake_read:
                    return
                poller.unregister(descriptor)
                announce(f"node_died: {names[descriptor]} has ended")

    thread = threading.Thread(target=watch, name="deaths", daemon=True)
    thread.start()
    try:
        yield
    finally:
        os.write(wake_write, b"x")
        thread.join()
        for descriptor in (wake_read, wake_write, *names):
            os.close(descriptor)
