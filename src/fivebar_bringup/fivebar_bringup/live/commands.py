"""Commands of the live page: emergency stop, reset, a plan and a motion. None of them sets a torque."""

from __future__ import annotations

from typing import NamedTuple

from fivebar_description.joint_sample import MessageError
from fivebar_description.outside_text import is_number, is_whole, one_line, read_object

STOP, RESET, PLAN, MOVE = "emergency_stop", "reset", "plan", "move"

FIELDS = {STOP: set[str](), RESET: set[str](), PLAN: {"x", "y", "assembly"}, MOVE: {"x", "y", "assembly"}}
"""Commands and their fields: x, y (m), and the sign of det A at the goal, 0 for either."""

LARGEST = 1e3
"""Largest coordinate (m) that is accepted."""


class CommandRefused(ValueError):
    """A message is not a valid command; says why."""


class Command(NamedTuple):
    """A command, with the goal of a plan or a motion."""

    name: str
    x: float = 0.0
    y: float = 0.0
    assembly: int = 0


def read_command(text: str | bytes) -> Command:
    """Return the command in a message of a page.

    Raises:
        CommandRefused: it is none, or has other fields than its own.
    """
    try:
        content = read_object(text)
    except MessageError as error:
        raise CommandRefused(str(error)) from None
    name = content.get("command")
    if not isinstance(name, str) or name not in FIELDS:
        raise CommandRefused(f"expected one of the commands {', '.join(FIELDS)}")
    given = {key: value for key, value in content.items() if key != "command"}
    if set(given) != FIELDS[name]:
        raise CommandRefused(f"{name}: expected the fields {sorted(FIELDS[name])}, got {one_line(str(sorted(given)))}")
    if not given:
        return Command(name)
    x, y, assembly = (given[key] for key in ("x", "y", "assembly"))
    if not all(is_number(value) and -LARGEST <= value <= LARGEST for value in (x, y)):
        raise CommandRefused(f"{name}: expected coordinates of at most {LARGEST:g} m")
    if not is_whole(assembly) or assembly not in (-1, 0, 1):
        raise CommandRefused(f"{name}: assembly: expected -1, 0 or 1")
    return Command(name, float(x), float(y), int(assembly))
