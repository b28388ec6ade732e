# SPDX-License-Identifier: Apache-2.0
"""The line protocol by which faults are injected while the emulation runs."""

from __future__ import annotations

import functools
import math
import re
from typing import NamedTuple

from fivebar_sim.drives.drive import ENCODER_EMERGENCY, LATE_BY, InjectedFault
from fivebar_sim.drives.emulation import Emulation
from fivebar_sim.emulated_hardware import obeyed

WORDS = {
    "fault": InjectedFault.FAULT,
    "lost": InjectedFault.LOST,
    "frozen": InjectedFault.FROZEN,
    "late": InjectedFault.LATE,
    "mute": InjectedFault.MUTE,
    "mend": InjectedFault.NONE,
}

USAGE = (
    "fault DRIVE [CODE], lost|mute|frozen|mend DRIVE, late DRIVE [MS], late_sync MS, bus_off, bus_on, home;"
    " DRIVE is 1 or 2, CODE an emergency code of four hexadecimal digits, MS 0 to 10000"
)


CODE = re.compile(r"[1-9A-Fa-f][0-9A-Fa-f]{3}")
"""An emergency code; 0000 would end a fault."""


class InjectionCommand(NamedTuple):
    """One line: its word, the drives that it is for (0, 1), and a time (s) or an emergency code where it has one."""

    word: str
    drives: tuple[int, ...]
    seconds: float = LATE_BY
    code: int = ENCODER_EMERGENCY


def read_command(line: str) -> InjectionCommand | None:
    """Return what a line such as "fault 1" or "late 2 5" asks for, None where it is not understood."""
    match line.split():
        case ["bus_off" | "bus_on" as word]:
            return InjectionCommand(word, (0, 1))
        case ["home" as word]:
            return InjectionCommand(word, ())
        case ["late_sync" as word, amount] if (seconds := _seconds(amount)) is not None:
            return InjectionCommand(word, (), seconds)
        case ["late" as word, ("1" | "2") as number, amount] if (seconds := _seconds(amount)) is not None:
            return InjectionCommand(word, (int(number) - 1,), seconds)
        case ["fault" as word, ("1" | "2") as number, digits] if CODE.fullmatch(digits):
            return InjectionCommand(word, (int(number) - 1,), code=int(digits, 16))
        case [word, ("1" | "2") as number] if word in WORDS:
            return InjectionCommand(word, (int(number) - 1,))
    return None


def execute(emulation: Emulation, line: str) -> str:
    """Execute one line and return the reply to its author."""
    return obeyed(line, read_command, functools.partial(_execute, emulation), USAGE)


def _execute(emulation: Emulation, order: InjectionCommand) -> None:
    if order.word == "late_sync":
        emulation.sync_delay = order.seconds
    if order.word == "home":
        emulation.go_home()
    for number in order.drives:
        drive = emulation.drives[number]
        if order.word in WORDS:
            drive.inject(WORDS[order.word], order.seconds, order.code)
        else:
            drive.network.cut = order.word == "bus_off"


def _seconds(text: str) -> float | None:
    """Return a number of milliseconds in seconds, None where it is not one."""
    try:
        amount = float(text)
    except ValueError:
        return None
    return amount / 1e3 if math.isfinite(amount) and 0.0 <= amount <= 1e4 else None
