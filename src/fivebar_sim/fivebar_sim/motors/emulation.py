# SPDX-License-Identifier: Apache-2.0
"""Two emulated motors on the bus or port of an interface, in the place of real ones."""

from __future__ import annotations

import functools
import threading
import time
from collections import deque
from collections.abc import Callable, Collection
from pathlib import Path
from typing import Any, Protocol

from fivebar_description.strict_yaml import validate
from fivebar_sim.emulated_hardware import Emulator, MeasuredRecord, obeyed
from fivebar_sim.motors.commands import USAGE, MotorOrder, read_order
from fivebar_sim.motors.configuration import MotorsEmulationFile
from fivebar_sim.motors.motors import EmulatedMotors

POLL_PERIOD = 0.002
"""Longest time (s) between two checks of the watchdog."""


class MotorLink(Protocol):
    """Where emulated motors are reached: their side of a bus or a port."""

    @property
    def place(self) -> str:
        """The bus or the port, in words."""
        ...

    def serve(self, motors: EmulatedMotors, timeout: float) -> None:
        """Wait for a frame for a time (s), and answer it as the drives do."""
        ...

    def close(self) -> None:
        """Leave the bus or the port."""
        ...


class MotorsEmulation:
    """The `EmulatedHardware` on a `MotorLink`."""

    def __init__(
        self,
        file: MotorsEmulationFile,
        open_link: Callable[[MotorsEmulationFile], MotorLink],
        errors: Collection[str] = (),
        holds: bool = False,
    ) -> None:
        """Switch the drives on, which may be put into errors of these names, and hold a torque that is not renewed.

        Raises:
            InputError: the robot, its posture, or the bus or port cannot be.
        """
        self.motors = EmulatedMotors(file, time.monotonic(), holds)
        self._link = open_link(file)
        self._read = functools.partial(read_order, errors=errors)
        self._plugged = True
        self.waits = file.pace == "commands"
        """Whether the robot moves on with the commands alone."""

    @property
    def history(self) -> deque[MeasuredRecord]:
        """The last measurements, the newest at the end."""
        return self.motors.history

    @property
    def place(self) -> str:
        """The bus or the port."""
        return self._link.place

    @property
    def resolution(self) -> float:
        """Size (rad) of the coarser encoder's count at the joint."""
        return max(motor.resolution for motor in self.motors.motors)

    def run(self, ending: threading.Event, between: Callable[[], None] = lambda: None) -> None:
        """Serve until `ending` is set; `between` is called between frames."""
        while not ending.is_set():
            if self._plugged:
                self._link.serve(self.motors, POLL_PERIOD)
            else:
                ending.wait(POLL_PERIOD)
            between()
            self.motors.tend(time.monotonic())

    def obey(self, line: str) -> str:
        """Execute one line of `USAGE` and return the reply to its author."""
        return obeyed(line, self._read, self._execute, USAGE)

    def carry(self, payload: float) -> None:
        """Go on with a payload (kg) on the platform."""
        self.motors.carry(payload)

    def close(self) -> None:
        """Leave the bus or the port."""
        self._link.close()

    def _execute(self, order: MotorOrder) -> None:
        motors = self.motors.motors
        match order:
            case MotorOrder("home"):
                self.motors.go_home()
            case MotorOrder("unplug" | "plug" as word):
                self._plugged = word == "plug"
            case MotorOrder("mend"):
                self._plugged = True
                for motor in motors:
                    motor.silent = motor.frozen = motor.faulty = False
                    motor.fault = ""
            case MotorOrder("fault", int(number), name):
                motors[number].faulty, motors[number].fault = True, name
                motors[number].command(False, 0.0)
            case MotorOrder("silent", int(number)):
                motors[number].silent = True
            case MotorOrder("frozen", int(number)):
                motors[number].frozen = True


def emulating(
    open_link: Callable[[MotorsEmulationFile], MotorLink], errors: Collection[str] = (), holds: bool = False
) -> Emulator:
    """Return the emulation of an interface whose drives are reached by a link of its own.

    Args:
        open_link: opens the drives' side of the bus or port of a file, or raises an `InputError`.
        errors: names of the errors that may be injected, where the drives have names for them.
        holds: whether a torque that is not renewed is held for ever, and not ended by a watchdog.
    """

    def opened(content: Any, path: Path) -> MotorsEmulation:
        return MotorsEmulation(validate(content, MotorsEmulationFile, str(path)), open_link, errors, holds)

    return Emulator(opened, USAGE, lambda line: read_order(line, errors) is not None)
