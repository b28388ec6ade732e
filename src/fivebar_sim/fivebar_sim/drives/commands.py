"""The line protocol by which faults are injected while the emulation runs."""

from __future__ import annotations

import math
from typing import NamedTuple

from fivebar_sim.drives.drive import LATE_BY, Injection
from fivebar_sim.drives.emulation import Emulation

WORDS = {
    "fault": Injection.FAULT,
    "lost": Injection.LOST,
    "frozen": Injection.FROZEN,
    "late": Injection.LATE,
    "mute": Injection.MUTE,
    "mend": Injection.NONE,
}

USAGE = (
    "fault|lost|mute|frozen|mend DRIVE, late DRIVE [MS], late_sync MS, bus_off, bus_on, home;"
    " DRIVE is 1 or 2, MS 0 to 10000"
)


class Order(NamedTuple):
    """One line: its keyword, the drives that it concerns (0, 1), and its time (s), if any."""

    word: str
    drives: tuple[int, ...]
    seconds: float = LATE_BY


def read_order(line: str) -> Order | None:
    """Parse a line such as "fault 1" or "late 2 5"; None where it is malformed."""
    match line.split():
        case ["bus_off" | "bus_on" as word]:
            return Order(word, (0, 1))
        case ["home" as word]:
            return Order(word, ())
        case ["late_sync" as word, amount] if (seconds := _seconds(amount)) is not None:
            return Order(word, (), seconds)
        case ["late" as word, ("1" | "2") as number, amount] if (seconds := _seconds(amount)) is not None:
            return Order(word, (int(number) - 1,), seconds)
        case [word, ("1" | "2") as number] if word in WORDS:
            return Order(word, (int(number) - 1,))
    return None


def execute(emulation: Emulation, line: str) -> str:
    """Execute one line and return the reply to its author."""
    order = read_order(line)
    if order is None:
        return f"not understood: {line.strip()!r}; expected {USAGE}"
    if order.word == "late_sync":
        emulation.sync_delay = order.seconds
    if order.word == "home":
        emulation.go_home()
    for number in order.drives:
        drive = emulation.drives[number]
        if order.word in WORDS:
            drive.inject(WORDS[order.word], order.seconds)
        else:
            drive.network.cut = order.word == "bus_off"
    return f"done: {line.strip()}"


def _seconds(text: str) -> float | None:
    """Return a number of milliseconds in seconds, None where it is not one."""
    try:
        amount = float(text)
    except ValueError:
        return None
    return amount / 1e3 if math.isfinite(amount) and 0.0 <= amount <= 1e4 else None
