# SPDX-License-Identifier: Apache-2.0
"""The emulated board on its port."""

from __future__ import annotations

import math
import os
import threading
import time
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any

from fivebar_description.motors_file import BY_THE_CLOCK
from fivebar_description.strict_yaml import validate
from fivebar_motkin_emulation.board import BOTH, EmulatedBoard
from fivebar_motkin_emulation.commands import USAGE, BoardOrder, read_order
from fivebar_motkin_emulation.configuration import BoardEmulationFile
from fivebar_motkin_emulation.port import PseudoPort
from fivebar_sim.emulated_hardware import Emulator, MeasuredRecord, obeyed

POLL_PERIOD = 0.002
"""Longest time (s) between two checks of the watchdog."""

HAND_OVER = 1e-4
"""Time (s) that this thread leaves its processor to others after an answer: the kernel passes the bytes on by a thread
without real-time priority, which one that has it, and goes on to move the robot, would keep waiting."""

READS_AT_ONCE = 16
"""Reads that are processed before the next such check."""


class BoardEmulation:
    """The board, served on a pseudo-terminal."""

    def __init__(self, file: BoardEmulationFile, clock: Callable[[], float] = time.monotonic) -> None:
        """Switch the board on and plug it in.

        Raises:
            InputError: the robot or its posture cannot be.
        """
        self._file = file
        self._clock = clock
        self.board = EmulatedBoard(file, clock())
        self.port = PseudoPort(Path(os.path.abspath(file.port)) if file.port else None)

    @property
    def history(self) -> deque[MeasuredRecord]:
        """The last measurements, the newest at the end."""
        return self.board.history

    @property
    def place(self) -> str:
        """The device that the client opens."""
        return self.port.path

    @property
    def resolution(self) -> float:
        """Size (rad) of the coarser encoder's count."""
        return math.tau / min(motor.counts_per_revolution for motor in self._file.pair)

    @property
    def waits(self) -> bool:
        """Whether the robot moves on with the commands alone."""
        return self._file.pace != BY_THE_CLOCK

    def run(self, ending: threading.Event, between: Callable[[], None] = lambda: None) -> None:
        """Serve the port until `ending` is set; `between` is called between frames."""
        while not ending.is_set():
            # commands that wait are processed before the watchdog looks: a delay of this process is none of the bridge
            timeout = POLL_PERIOD
            for _ in range(READS_AT_ONCE):
                data = self.port.read(timeout)
                if not data:
                    break
                for answer in self.board.take(data, self._clock()):
                    self.port.write(answer)
                    time.sleep(HAND_OVER)
                timeout = 0.0
            between()
            self.port.write(self.board.tend(self._clock()))

    def obey(self, line: str) -> str:
        """Execute one line of `USAGE` and return the reply to its author."""
        return obeyed(line, read_order, self._execute, USAGE)

    def carry(self, payload: float) -> None:
        """Go on with a payload (kg) on the platform."""
        self.board.carry(payload)

    def close(self) -> None:
        """Take the port away."""
        self.port.unplug()

    def _execute(self, order: BoardOrder) -> None:
        board, number = self.board, order.number
        match order.word:
            case "fault":
                board.trip(number)
            case "button press" | "button hold":
                board.hold_button(self._clock())
            case "button release":
                board.release_button()
            case "reset":
                self.port.unplug()
                board.reboot(self._clock())
                self.port.plug()
            case "unready":
                board.ready &= ~(1 << number)
            case "ready":
                board.ready |= 1 << number
            case "frozen" | "thawed":
                board.motors[number].frozen = order.word == "frozen"
            case "drop":
                board.drop = number
            case "corrupt":
                board.corrupt = number
            case "ignore":
                board.ignore = number
            case "silent":
                board.silent = True
            case "unplug":
                self.port.unplug()
            case "plug":
                self.port.plug()
            case "home":
                board.go_home()
            case "mend":
                self._mend()

    def _mend(self) -> None:
        """Remove all injected faults but a control fault, which needs a reset of the board."""
        board = self.board
        board.drop = board.corrupt = board.ignore = 0
        board.silent = False
        board.ready = BOTH
        for motor in board.motors:
            motor.frozen = False
        self.port.plug()


def _open(content: Any, path: Path) -> BoardEmulation:
    return BoardEmulation(validate(content, BoardEmulationFile, str(path)))


EMULATOR = Emulator(_open, USAGE, lambda line: read_order(line) is not None)
