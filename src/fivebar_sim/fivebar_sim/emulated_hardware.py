# SPDX-License-Identifier: Apache-2.0
"""The common interface of emulated drives and emulated boards, for those who run and judge a rehearsal."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeVar

from fivebar_sim.plant import Measurement

O = TypeVar("O")

HISTORY = 64
"""Number of measurements that are kept."""


class MeasuredRecord(NamedTuple):
    """One measurement: its number, the joint angles (rad) of both encoders, and the exact state."""

    number: int
    angles: tuple[float, float]
    truth: Measurement


class EmulatedHardware(Protocol):
    """Hardware that moves the simulated robot."""

    @property
    def history(self) -> deque[MeasuredRecord]:
        """The last measurements, the newest at the end."""
        ...

    @property
    def place(self) -> str:
        """The bus or the port."""
        ...

    @property
    def resolution(self) -> float:
        """Size (rad) of the coarser encoder's count at the joint."""
        ...

    @property
    def waits(self) -> bool:
        """Whether the robot moves on with the commands alone, so that a late one stretches time."""
        ...

    def run(self, ending: threading.Event, between: Callable[[], None] = ...) -> None:
        """Serve until `ending` is set; `between` is called again and again."""
        ...

    def obey(self, line: str) -> str:
        """Break, mend or reset something as a line of text says; return the reply."""
        ...

    def carry(self, payload: float) -> None:
        """Go on with a payload (kg) on the platform; for the thread that serves."""
        ...

    def close(self) -> None:
        """Leave the bus or the port."""
        ...


def obeyed(line: str, read: Callable[[str], O | None], execute: Callable[[O], None], usage: str) -> str:
    """Execute one line by which faults are injected, and return the reply to its author.

    Args:
        line: the text.
        read: returns the order in a line, None where it is none.
        execute: executes an order.
        usage: the orders, in words.
    """
    order = read(line)
    if order is None:
        return f"not understood: {line.strip()!r}; expected {usage}"
    execute(order)
    return f"done: {line.strip()}"


class Emulator(NamedTuple):
    """How the hardware of one interface is emulated.

    Attributes:
        open: emulates what a file describes, given as parsed and with its path, or raises an `InputError`.
        usage: the orders by which faults are injected, in words.
        understands: returns whether a line of text is such an order.
    """

    open: Callable[[Any, Path], EmulatedHardware]
    usage: str
    understands: Callable[[str], bool]
