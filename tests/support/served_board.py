# SPDX-License-Identifier: Apache-2.0
"""An emulated board that a thread of this process serves on a pseudo-terminal."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from bench_robot import emulation_content

from fivebar_motkin_emulation.commands import read_order
from fivebar_motkin_emulation.configuration import BoardEmulationFile
from fivebar_motkin_emulation.emulation import BoardEmulation

DEADLINE = 20.0


def made(folder: Path, **changes: Any) -> BoardEmulationFile:
    return BoardEmulationFile.model_validate(emulation_content(folder, **changes), strict=False)


class Served:
    """A board that a thread serves; orders are obeyed there."""

    def __init__(self, file: BoardEmulationFile) -> None:
        self.emulation = BoardEmulation(file)
        self.board = self.emulation.board
        self._orders: list[str] = []
        self._ending = threading.Event()
        self._thread = threading.Thread(target=self.emulation.run, args=(self._ending, self._obey))
        self._thread.start()

    def _obey(self) -> None:
        while self._orders:
            self.emulation.obey(self._orders[0])
            self._orders.pop(0)

    def order(self, *lines: str) -> None:
        assert all(read_order(line) for line in lines)
        self._orders += lines
        wait_for(lambda: not self._orders)

    def close(self) -> None:
        self._ending.set()
        self._thread.join()
        self.emulation.close()


def wait_for(condition: Callable[[], bool]) -> None:
    end = time.monotonic() + DEADLINE
    while not condition():
        assert time.monotonic() < end
        time.sleep(1e-3)
