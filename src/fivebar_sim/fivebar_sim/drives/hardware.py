# SPDX-License-Identifier: Apache-2.0
"""The emulated drives on the bus of their file."""

from __future__ import annotations

import math
import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

import can

from fivebar_description.network import can_problem
from fivebar_description.strict_yaml import InputError, validate
from fivebar_sim.drives.commands import USAGE, execute, read_command
from fivebar_sim.drives.configuration import EmulationFile
from fivebar_sim.drives.emulation import Emulation, open_bus
from fivebar_sim.emulated_hardware import Emulator, MeasuredRecord


class DrivesOnBus:
    """Two emulated drives, and the bus that they alone use in this process."""

    def __init__(self, file: EmulationFile) -> None:
        """Open the bus and boot the drives.

        Raises:
            InputError: the bus cannot be opened, or the robot or its posture cannot be.
        """
        try:
            self._bus = open_bus(file.bus)
        except (can.CanError, OSError) as error:
            raise InputError(can_problem(file.bus.interface, file.bus.channel, error)) from error
        self.emulation = Emulation(file, self._bus)
        self.place = f"{file.bus.interface} {file.bus.channel}"
        self.resolution = max(math.tau / (drive.counts_per_revolution * drive.gear_ratio) for drive in file.pair)
        """Size (rad) of the coarser encoder's count at the joint."""

        self.waits = False
        """The bus has no time to spare: with every SYNC the robot moves on."""

    @property
    def history(self) -> deque[MeasuredRecord]:
        """The last SYNCs, the newest at the end."""
        return self.emulation.history

    def run(self, ending: threading.Event, between: Callable[[], None] = lambda: None) -> None:
        """Serve the bus until `ending` is set; `between` is called between frames."""
        self.emulation.run(ending, between)

    def obey(self, line: str) -> str:
        """Execute one line of the drives' protocol and return the reply to its author."""
        return execute(self.emulation, line)

    def carry(self, payload: float) -> None:
        """Go on with a payload (kg) on the platform."""
        self.emulation.carry(payload)

    def close(self) -> None:
        """Leave the bus."""
        self._bus.shutdown()


def _open(content: Any, path: Path) -> DrivesOnBus:
    return DrivesOnBus(validate(content, EmulationFile, str(path)))


EMULATOR = Emulator(_open, USAGE, lambda line: read_command(line) is not None)
