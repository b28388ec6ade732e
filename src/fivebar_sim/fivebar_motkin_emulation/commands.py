# SPDX-License-Identifier: Apache-2.0
"""The line protocol by which faults are injected into the running board and removed again."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_motkin_emulation.protocol import CAUSES

USAGE = (
    "fault CAUSE, button press|release|hold, reset, unready|ready|frozen|thawed MOTOR, drop|corrupt|ignore FRAMES,"
    " silent, unplug, plug, mend, home; CAUSE is 0 to 9, MOTOR 1 or 2"
)

MOST_FRAMES = 1_000_000


class BoardOrder(NamedTuple):
    """One line: its word and its number, where it has one; of a motor 0 or 1."""

    word: str
    number: int = 0


def read_order(line: str) -> BoardOrder | None:
    """Return what a line such as "fault 5" or "drop 20" asks for, None where it is not understood."""
    match line.split():
        case ["reset" | "silent" | "unplug" | "plug" | "mend" | "home" as word]:
            return BoardOrder(word)
        case ["button", "press" | "release" | "hold" as word]:
            return BoardOrder(f"button {word}")
        case ["unready" | "ready" | "frozen" | "thawed" as word, ("1" | "2") as number]:
            return BoardOrder(word, int(number) - 1)
        case ["fault", number] if number.isdecimal() and int(number) in CAUSES:
            return BoardOrder("fault", int(number))
        case ["drop" | "corrupt" | "ignore" as word, number] if number.isdecimal() and int(number) <= MOST_FRAMES:
            return BoardOrder(word, int(number))
    return None
