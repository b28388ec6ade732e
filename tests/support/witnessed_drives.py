"""Two emulated drives in a process of their own, which tells on standard output what torque they give at every SYNC.

Arguments: the file of the emulation, and a priority under SCHED_FIFO that is taken where it is granted. Standard input:
lines of the drives' protocol; each is answered with "obeyed".
"""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import sys
import threading

from fivebar_sim.drives.commands import execute
from fivebar_sim.drives.configuration import load_emulation
from fivebar_sim.drives.emulation import Emulation, open_bus


def main() -> None:
    """Serve the bus until SIGTERM or the end of standard input."""
    file, priority = load_emulation(sys.argv[1]), int(sys.argv[2])
    with contextlib.suppress(PermissionError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))
    ending = threading.Event()
    signal.signal(signal.SIGTERM, lambda number, frame: ending.set())
    orders: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read_orders() -> None:
        for line in sys.stdin:
            orders.put(line)
        ending.set()

    threading.Thread(target=read_orders, daemon=True).start()
    bus = open_bus(file.bus)
    emulation = Emulation(file, bus)
    told: tuple[float, ...] = ()

    def tell(word: str) -> None:
        nonlocal told
        first, second = (drive.torque for drive in emulation.drives)
        facts = (emulation.syncs, first, second)
        if word == "look" and facts == told:
            return
        told = facts
        speed = max(abs(emulation.plant.joint_velocities))
        print(word, emulation.syncs, repr(first), repr(second), repr(float(speed)), flush=True)

    def between() -> None:
        tell("look")
        while not orders.empty():
            answer = execute(emulation, orders.get())
            assert answer.startswith("done"), answer
            tell("obeyed")

    emulation.run(ending, between)
    bus.shutdown()


if __name__ == "__main__":
    main()
