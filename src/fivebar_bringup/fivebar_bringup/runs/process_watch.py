# SPDX-License-Identifier: Apache-2.0
"""Process watch: reports a process that has ended within milliseconds, by waiting on pidfds instead of polling."""

from __future__ import annotations

import os
import select
import threading
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager


@contextmanager
def watch_processes(processes: Mapping[str, int], report: Callable[[str], None]) -> Iterator[None]:
    """Within the context, call `report` from a thread with the text of a fault for every process that ends.

    `processes` are process ids by name; a process that has already ended is reported as well.
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
                report(f"node_died: {names[descriptor]} has ended")

    thread = threading.Thread(target=watch, name="process_watch", daemon=True)
    thread.start()
    try:
        yield
    finally:
        os.write(wake_write, b"x")
        thread.join()
        for descriptor in (wake_read, wake_write, *names):
            os.close(descriptor)
