"""The line protocol by which faults are injected while the emulation runs."""

from __future__ import annotations

import math

from fivebar_sim.drives.drive import LATE_BY, Injection
from fivebar_sim.drives.emulation import Emulation

WORDS = {
    "fault": Injection.FAULT,
    "lost": Injection.LOST,
    "frozen": Injection.FROZEN,
    "late": Injection.LATE,
    "mend": Injection.NONE,
}

USAGE = "fault|lost|frozen|mend DRIVE, late DRIVE [MS], bus_off, bus_on; DRIVE is 1 or 2"


def obey(emulation: Emulation, line: str) -> str:
    """Obey one line, such as "fault 1" or "late 2 5"; return what to tell the person who wrote it."""
    match line.split():
        case ["bus_off" | "bus_on" as word]:
            for drive in emulation.drives:
                drive.network.cut = word == "bus_off"
        case [word, ("1" | "2") as number] if word in WORDS:
            emulation.drives[int(number) - 1].inject(WORDS[word])
        case ["late", ("1" | "2") as number, amount] if _milliseconds(amount) is not None:
            emulation.drives[int(number) - 1].inject(Injection.LATE, _milliseconds(amount) or LATE_BY)
        case _:
            return f"not understood: {line.strip()!r}; expected {USAGE}"
    return f"done: {line.strip()}"


def _milliseconds(text: str) -> float | None:
    """Return a number of milliseconds in seconds, None where it is not one."""
    try:
        amount = float(text)
    except ValueError:
        return None
    return amount / 1e3 if math.isfinite(amount) and 0.0 < amount <= 1e4 else None
