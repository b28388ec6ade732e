# SPDX-License-Identifier: Apache-2.0
"""The line protocol by which faults are injected into emulated motors and removed again."""

from __future__ import annotations

from collections.abc import Collection
from typing import NamedTuple

USAGE = "fault MOTOR [NAME], silent|frozen MOTOR, unplug, plug, mend, home; MOTOR is 1 or 2, NAME an error of the drive"


class MotorOrder(NamedTuple):
    """One line: its word, its motor, 0 or 1, and the name of the drive's error, where it has these."""

    word: str
    motor: int | None = None
    name: str = ""


def read_order(line: str, errors: Collection[str] = ()) -> MotorOrder | None:
    """Return what a line such as "fault 1" asks for, None where it is not understood.

    Args:
        line: the text.
        errors: names of the errors that the drive has.
    """
    match line.split():
        case ["unplug" | "plug" | "mend" | "home" as word]:
            return MotorOrder(word)
        case ["fault" | "silent" | "frozen" as word, ("1" | "2") as number]:
            return MotorOrder(word, int(number) - 1)
        case ["fault" as word, ("1" | "2") as number, name] if name in errors:
            return MotorOrder(word, int(number) - 1, name)
    return None
