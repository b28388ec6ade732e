# SPDX-License-Identifier: Apache-2.0
"""Emulated hardware in a process of its own; faults are injected by lines on standard input."""

from __future__ import annotations

import argparse
import queue
import signal
import sys
import threading
from types import FrameType

from fivebar_description.interrupts import service_signals
from fivebar_description.strict_yaml import InputError
from fivebar_sim.emulators.hardware_kinds import emulator_of, open_hardware

BAD_INPUT = 2


def serve(program: str, interface: str, default: str) -> None:
    """Serve until a signal asks for the end; exit status 0 then, 2 for bad input.

    Args:
        program: its name.
        interface: that whose orders the help names, and that of a file which names none.
        default: name of the emulation by default.
    """
    epilog = f"Standard input: {emulator_of(interface).usage}."
    parser = argparse.ArgumentParser(prog=program, description=__doc__, epilog=epilog)
    parser.add_argument("emulation", nargs="?", default=default, help="shipped name or path of a .yaml file")
    arguments = parser.parse_args()
    ending = threading.Event()

    def stop(number: int, frame: FrameType | None) -> None:
        ending.set()

    for number in service_signals():
        signal.signal(number, stop)
    try:
        hardware, _ = open_hardware(arguments.emulation, interface)
    except InputError as error:
        print(error, file=sys.stderr)
        sys.exit(BAD_INPUT)
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read_lines() -> None:
        for line in sys.stdin:
            lines.put(line)

    def obey_lines() -> None:
        while not lines.empty():
            print(hardware.obey(lines.get()), flush=True)

    threading.Thread(target=read_lines, daemon=True).start()
    print(f"ready: {hardware.place}", flush=True)
    try:
        hardware.run(ending, obey_lines)
    finally:
        hardware.close()
