"""`emulated_drives`: two drives in a process of their own; faults are injected by lines on standard input."""

from __future__ import annotations

import argparse
import queue
import signal
import sys
import threading
from types import FrameType

import can

from fivebar_description.strict_yaml import InputError
from fivebar_sim.drives.commands import USAGE, execute
from fivebar_sim.drives.configuration import load_emulation
from fivebar_sim.drives.emulation import Emulation, open_bus

BAD_INPUT = 2


def main() -> None:
    """Run the emulated drives until SIGINT or SIGTERM; exit status 0 then, 2 for bad input."""
    parser = argparse.ArgumentParser(prog="emulated_drives", description=__doc__, epilog=f"Standard input: {USAGE}.")
    parser.add_argument("emulation", nargs="?", default="dextar_emulated", help="shipped name or path of a .yaml file")
    arguments = parser.parse_args()
    ending = threading.Event()

    def stop(number: int, frame: FrameType | None) -> None:
        ending.set()

    signal.signal(signal.SIGINT, stop)
    signal.signal(signal.SIGTERM, stop)
    try:
        file = load_emulation(arguments.emulation)
        bus = open_bus(file.bus)
    except (InputError, can.CanError, OSError) as error:
        print(" ".join(str(error).split()), file=sys.stderr)
        sys.exit(BAD_INPUT)
    lines: queue.SimpleQueue[str] = queue.SimpleQueue()

    def read_lines() -> None:
        for line in sys.stdin:
            lines.put(line)

    threading.Thread(target=read_lines, daemon=True).start()
    try:
        emulation = Emulation(file, bus)
        print(f"ready: {file.name} on {file.bus.interface} {file.bus.channel}", flush=True)

        def look_for_lines() -> None:
            while not lines.empty():
                print(execute(emulation, lines.get()), flush=True)

        emulation.run(ending, look_for_lines)
    except InputError as error:
        print(error, file=sys.stderr)
        sys.exit(BAD_INPUT)
    finally:
        bus.shutdown()


if __name__ == "__main__":
    main()
