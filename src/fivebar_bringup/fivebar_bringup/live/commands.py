"""Commands of the live page: emergency stop, reset, a plan and a motion. None of them sets a torque."""

from __future__ import annotations

import json
from typing import NamedTuple

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
        content = json.loads(text)
    except (ValueError, RecursionError):
        raise CommandRefused("expected JSON") from None
    name = content.get("command") if isinstance(content, dict) else None
    if not isinstance(name, str) or name not in FIELDS:
        raise CommandRefused(f"expected one of the commands {', '.join(FIELDS)}")
    given = {key: value for key, value in content.items() if key != "command"}
    if set(given) != FIELDS[name]:
        raise CommandRefused(f"{name}: expected the fields {sorted(FIELDS[name])}, got {sorted(given)}")
    if not given:
        return Command(name)
    x, y, assembly = (given[key] for key in ("x", "y", "assembly"))
    if not all(isinstance(value, int | float) and -LARGEST <= value <= LARGEST for value in (x, y)):
        raise CommandRefused(f"{name}: expected coordinates of at most {LARGEST:g} m")
    if assembly not in (-1, 0, 1):
        raise CommandRefused(f"{name}: assembly: expected -1, 0 or 1")
    return Command(name, float(x), float(y), int(assembly))
