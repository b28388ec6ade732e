"""The line protocol by which faults are injected into emulated motors and removed again."""

from __future__ import annotations

from typing import NamedTuple

USAGE = "fault|silent|frozen MOTOR, unplug, plug, mend, home; MOTOR is 1 or 2"


class MotorOrder(NamedTuple):
    """One line: its word and its motor, 0 or 1, where it has one."""

    word: str
    motor: int | None = None


def read_order(line: str) -> MotorOrder | None:
    """Return what a line such as "fault 1" asks for, None where it is not understood."""
    match line.split():
        case ["unplug" | "plug" | "mend" | "home" as word]:
            return MotorOrder(word)
        case ["fault" | "silent" | "frozen" as word, ("1" | "2") as number]:
            return MotorOrder(word, int(number) - 1)
    return None
