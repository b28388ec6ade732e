# SPDX-License-Identifier: Apache-2.0
"""Emulated drives or an emulated board in a process of their own, which tells what torque they give at every SYNC.

A board has no SYNC: its periods are counted. Arguments: the file of the emulation, and a priority under SCHED_FIFO that
is taken where it is granted. Standard input: lines of the drives' or the board's protocol; each is answered with
"obeyed".
"""

from __future__ import annotations

import contextlib
import os
import queue
import signal
import sys
import threading

from fivebar_motkin_emulation.emulation import BoardEmulation
from fivebar_sim.emulated_hardware import EmulatedHardware
from fivebar_sim.emulators.hardware_kinds import open_hardware


def seen(hardware: EmulatedHardware) -> tuple[int, float, float, float]:
    """SYNCs or periods so far, both torques (Nm), and the speed (rad/s) of the fastest joint."""
    if isinstance(hardware, BoardEmulation):
        moved, plant = hardware.board.periods, hardware.board.plant
        first, second = (motor.joint_torque(motor.state.target) for motor in hardware.board.motors)
    else:
        emulation = hardware.emulation
        moved, plant = emulation.syncs, emulation.plant
        first, second = (drive.torque for drive in emulation.drives)
    return moved, first, second, float(max(abs(plant.joint_velocities)))


def main() -> None:
    """Serve until SIGTERM or the end of standard input."""
    path, priority = sys.argv[1], int(sys.argv[2])
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
    hardware, _ = open_hardware(path)
    told: tuple[float, ...] = ()

    def tell(word: str) -> None:
        nonlocal told
        *facts, speed = seen(hardware)
        if word == "look" and tuple(facts) == told:
            return
        told = tuple(facts)
        print(word, *map(repr, (*facts, speed)), flush=True)

    def between() -> None:
        tell("look")
        while not orders.empty():
            answer = hardware.obey(orders.get())
            assert answer.startswith("done"), answer
            tell("obeyed")

    hardware.run(ending, between)
    hardware.close()


if __name__ == "__main__":
    main()
